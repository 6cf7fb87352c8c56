#pragma once
#include <openvdb/Grid.h>

#include <cstdint>
#include <type_traits>

#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"

// OpenVDB's definitions of the types that levelset/narrow_band.hpp declares, for reading and writing voxels.
// Making a grid instantiates its virtual functions, file formats included, in every file that does so.
// Declared extern here, they are instantiated once, in levelset/openvdb_instances.cpp.
extern template class openvdb::Grid<sidewall::surface::VoxelTree<float>>;
extern template class openvdb::tree::Tree<sidewall::surface::VoxelTree<float>::RootNodeType>;
extern template class openvdb::tree::Tree<sidewall::surface::VoxelTree<std::int32_t>::RootNodeType>;

namespace sidewall::levelset {

static_assert(std::is_same_v<GridPtr, Grid::Ptr>);

using Leaf = Grid::TreeType::LeafNodeType;
using Nodes = Leaf::NodeMaskType;  ///< a set of a leaf's nodes

/// The nodes of a leaf in the plane \p local (0 .. 7) across an axis.
inline Nodes nodes_in_plane(int axis, int local) {
    const int shift = 6 - 3 * axis;
    Nodes nodes;
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n)
        if (static_cast<int>(n >> shift & 7) == local) nodes.setOn(n);
    return nodes;
}

/// The grid edge from node \p low along \p axis, on which a vertex of marching cubes lies.
struct NodeEdge {
    openvdb::Coord low;
    int axis = 0;
};
/// The grid edge of a vertex at \p index (index space), of which two coordinates are whole numbers.
NodeEdge edge_at(const Vec3& index);

/// Deactivates a leaf's nodes that have reached the background or lie outside the domain.
/// \returns whether any are left.
bool trim_leaf(Leaf& leaf, const Domain& domain, float background);

/// Whether own node \p ijk lies inside, also far from the band: there the answer is read from the nearest
/// leaf above (materials rest on an unbounded substrate, and gas is above all).
bool inside(const Grid& grid, const openvdb::Coord& ijk);

}  // namespace sidewall::levelset
