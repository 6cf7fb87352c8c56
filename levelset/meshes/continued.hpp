#pragma once
#include <vector>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// The fronts of the lower layers as they would go on where the layers above cut them off. A layer is held as the
/// greater of its own distance and the next layer's, so that its own is known only where it is greater. At nodes
/// within two cells of such ones a plane fitted to them goes on, no higher than the next layer's value; at all others
/// the layer counts as deep inside. Beside an edge where the next front cuts the layer off, as the flush wall of a
/// trench does, re-distancing has made its distances those to the edge: where the nodes that are buried, farther from
/// the next front than from the layer's own, lie in a plane, and the next front crosses it in another that goes on
/// beyond, the layer goes on by these nodes alone, no higher than the values that are there. The greatest of the
/// continued fronts of a layer and of all above it is that layer's level set.
///
/// \param finer  the next finer level, where there is one: of several levels, fronts go on where the stack's own counts.
/// \returns by layer but the last one, each with the voxels of the layer's own grid.
/// \note O(n), parallel.
std::vector<GridPtr> continued_fronts(const MaterialStack& stack, const MaterialStack* finer = nullptr);

}  // namespace sidewall::levelset
