#pragma once
#include <openvdb/version.h>

#include <cstdint>

// OpenVDB's grids by name alone. Their definitions take seconds to compile in every file that includes them;
// files that only hand a grid on include this, files that read voxels include <openvdb/Grid.h> as well.
namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
template <typename>
class Grid;
namespace tree {
template <typename>
class Tree;
template <typename>
class RootNode;
template <typename, std::uint32_t>
class InternalNode;
template <typename, std::uint32_t>
class LeafNode;
}  // namespace tree
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace sidewall::surface {

/// OpenVDB's usual tree: leaves of 8^3 voxels under nodes of 16^3 and 32^3.
template <class T>
using VoxelTree = openvdb::tree::Tree<openvdb::tree::RootNode<
    openvdb::tree::InternalNode<openvdb::tree::InternalNode<openvdb::tree::LeafNode<T, 3>, 4>, 5>>>;

/// openvdb::FloatGrid.
using FloatGrid = openvdb::Grid<VoxelTree<float>>;

}  // namespace sidewall::surface
