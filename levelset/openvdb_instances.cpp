#include "levelset/openvdb_grid.hpp"

template class openvdb::Grid<sidewall::surface::VoxelTree<float>>;
template class openvdb::tree::Tree<sidewall::surface::VoxelTree<float>::RootNodeType>;
template class openvdb::tree::Tree<sidewall::surface::VoxelTree<std::int32_t>::RootNodeType>;
