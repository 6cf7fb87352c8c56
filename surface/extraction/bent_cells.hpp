#pragma once
#include <boost/container/static_vector.hpp>
#include <utility>
#include <vector>

#include "surface/extraction/crossing_planes.hpp"
#include "surface/extraction/cut_leaves.hpp"

namespace sidewall::surface {

inline constexpr std::uint32_t kNone = 0xffffffffu;

/// Defects of planes: up to kSound one may replace another; above kUnsound it is to be replaced.
inline constexpr double kSound = 0.15, kUnsound = 0.3;

/// A crossed edge of a cell.
struct Corner {
    std::uint32_t crossing;  ///< periodic images share one
    std::uint32_t vertex;    ///< of the mesh
    int edge;                ///< of the cell
};

/// A cell with a bent node (bent_nodes) at a corner, as at an edge of the surface.
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

/// The cells with one polygon and a bent node at a corner, in the order of their triangles.
std::vector<BentCell> bent_cells(const CutLeaves& leaves, const LateralGrid& box);

/// Numbers the crossings of the cells, sets the loops of the cells and finds the planes. An unsound plane is
/// replaced by the nearest sound one in a cell that both share.
Crossings find_crossings(const CutLeaves& leaves, const LateralGrid& box, std::vector<BentCell>& cells);

}  // namespace sidewall::surface
