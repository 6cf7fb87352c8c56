#pragma once
#include <boost/container/static_vector.hpp>
#include <utility>
#include <vector>

#include "surface/extraction/crossing_planes.hpp"
#include "surface/extraction/cut_leaves.hpp"

namespace sidewall::surface {

inline constexpr std::uint32_t kNone = 0xffffffffu;

/// Defects of planes: that may stand for another, and that are to be replaced.
inline constexpr double kSound = 0.15, kUnsound = 0.3;

/// A crossed edge of a cell.
struct Corner {
    std::uint32_t crossing;  ///< periodic images share one
    std::uint32_t vertex;    ///< of the mesh
    int edge;                ///< of the cell
};

/// A cell beside which the values bend, as at an edge of the surface.
struct BentCell {
    openvdb::Coord cell;
    std::uint8_t pattern;
    std::uint32_t first_triangle;
    boost::container::static_vector<Corner, 12> loop;  ///< counter-clockwise seen from outside the material
};

/// The planes at all crossings of bent cells.
struct Crossings {
    std::vector<std::pair<openvdb::Coord, int>> edge;  ///< low node and axis
    std::vector<CrossingPlane> plane;
    std::vector<double>
        lift;  ///< cells: how far a plane taken from a neighbour lies above the crossing, along its normal
};

/// Where a corner of a loop lies, in cells from the low corner of its cell.
Vec3 local_point(const Corner& corner, const CrossingPlane& plane);

/// The cells of one polygon of which a corner is a bent node, in the order of their triangles.
std::vector<BentCell> bent_cells(const CutLeaves& leaves, const LateralGrid& box);

/// Numbers the crossings of the cells, which get their loops, and finds their planes. Those that are unsound get that of the
/// nearest sound one in a cell that they share.
Crossings find_crossings(const CutLeaves& leaves, const LateralGrid& box, std::vector<BentCell>& cells);

}  // namespace sidewall::surface
