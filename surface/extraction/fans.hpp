#pragma once
#include <array>

#include "surface/extraction/bent_cells.hpp"

namespace sidewall::surface {

/// A cell whose polygon is filled by triangles around a vertex of its own, the apex.
struct Fan {
    const BentCell* of;
    Vec3 apex;  ///< in cells from the cell's low corner
    EdgeKind kind;
    std::array<int, 3> taken{};  ///< way to the cell beside it in which the apex lies; 0, 0, 0: its own
    /// By segment of the loop: a vertex that the apex is joined to across it, kNone where it is not; and whether that vertex
    /// lies on the segment, which is on a side of the domain then.
    boost::container::static_vector<std::uint32_t, 12> turned;
    boost::container::static_vector<bool, 12> split;
};

/// The fans of the cells whose planes make an edge of the kinds asked for; not yet joined.
std::vector<Fan> find_fans(const CutLeaves& leaves, const LateralGrid& box,
                           const std::vector<BentCell>& cells, const Crossings& crossings, SharpEdges which);

}  // namespace sidewall::surface
