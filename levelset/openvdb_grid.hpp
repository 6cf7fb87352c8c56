#pragma once
#include <openvdb/Grid.h>

#include <cstdint>
#include <type_traits>

#include "levelset/grid.hpp"

// What it takes to read and write voxels: OpenVDB's definitions of the types that levelset/grid.hpp declares.
// Making a grid instantiates its virtual functions, file formats included, in every file that does: here they
// are declared, and levelset/openvdb_grid.cpp holds them once.
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

/// Takes nodes out of a leaf's band that have come to the background or lie outside the domain.
/// \returns whether any are left.
bool trim_leaf(Leaf& leaf, const Domain& domain, float background);

/// Whether own node \p ijk lies inside, wherever it is: far from the band the answer is read from the nearest
/// leaf above (materials rest on an unbounded substrate, and gas is above all).
bool inside(const Grid& grid, const openvdb::Coord& ijk);

}  // namespace sidewall::levelset
