#pragma once
#include <span>

#include "levelset/openvdb_grid.hpp"
#include "levelset/stack.hpp"

namespace sidewall::levelset {

/// Releases the nodes of lower layers that were bare before a time step and did not grow, for cut_layers to set: they
/// follow the surface, and nothing that re-distancing changes there can come to lie on them. Not so beside a piece of
/// their layer's front that a film grows over: the surface leaves it, and the layer's front stays.
///
/// \param leaves  of the surface, which has moved and is not re-distanced yet.
/// \param before  their values at the time step's start, Leaf::SIZE a leaf.
/// \note Parallel; O(n) in voxels.
void release_exposed(MaterialStack& stack, std::span<Leaf* const> leaves, const float* before);

}  // namespace sidewall::levelset
