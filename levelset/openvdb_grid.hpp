#pragma once
#include <openvdb/Grid.h>

#include <cstdint>
#include <type_traits>

#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"

// Reading and writing voxels: OpenVDB's definitions of the types that levelset/narrow_band.hpp declares.
// Making a grid instantiates its virtual functions, file formats included, in every file that does: here they
// are declared, and levelset/openvdb_instances.cpp holds them once.
extern template class openvdb::Grid<sidewall::surface::VoxelTree<float>>;
extern template class openvdb::tree::Tree<sidewall::surface::VoxelTree<float>::RootNodeType>;
extern template class openvdb::tree::Tree<sidewall::surface::VoxelTree<std::int32_t>::RootNodeType>;

namespace sidewall::levelset {

static_assert(std::is_same_v<GridPtr, Grid::Ptr>);

using Leaf = Grid::TreeType::LeafNodeType;
using Nodes = Leaf::NodeMaskType;  ///< some of a leaf's

/// The nodes of a leaf in the plane \p local (0 .. 7) across an axis.
inline Nodes nodes_in_plane(int axis, int local) {
    const int shift = 6 - 3 * axis;
    Nodes nodes;
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n)
        if (static_cast<int>(n >> shift & 7) == local) nodes.setOn(n);
    return nodes;
}

/// The edge of the grid that a vertex of marching cubes lies on: two of its indices are whole.
struct NodeEdge {
    openvdb::Coord low;
    int axis = 0;
};
/// \param index  the vertex, in node indices.
NodeEdge edge_at(const Vec3& index);

/// Deactivates a leaf's nodes that have reached the background or lie outside the domain.
/// \returns whether any are left.
bool trim_leaf(Leaf& leaf, const Domain& domain, float background);

/// Whether own node \p ijk lies inside, wherever it is: far from the band the answer is read from the nearest
/// leaf above (materials rest on an unbounded substrate, and gas is above all).
bool inside(const Grid& grid, const openvdb::Coord& ijk);

}  // namespace sidewall::levelset
