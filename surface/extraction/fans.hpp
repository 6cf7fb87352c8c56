#pragma once
#include <array>

#include "surface/extraction/bent_cells.hpp"

namespace sidewall::surface {

/// A cell whose polygon is filled by triangles around an additional vertex, the apex.
struct Fan {
    const BentCell* of;
    Vec3 apex;  ///< in cells from the cell's low corner
    EdgeKind kind;
    std::array<int, 3> taken{};  ///< offset of the cell beside it in which the apex lies; 0, 0, 0: this one
    /// By segment of the loop: the vertex across it that the apex is joined to, or kNone; and whether that
    /// vertex lies on the segment, which is then on a side of the domain.
    boost::container::static_vector<std::uint32_t, 12> joined_to;
    boost::container::static_vector<bool, 12> split;
};

/// The fans, not joined yet, of the cells whose planes make an edge that \p which allows.
std::vector<Fan> find_fans(const CutLeaves& leaves, const LateralGrid& box,
                           const std::vector<BentCell>& cells, const Crossings& crossings, SharpEdges which);

}  // namespace sidewall::surface
