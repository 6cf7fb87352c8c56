#pragma once
#include <vector>

#include "levelset/stack.hpp"

namespace sidewall::levelset {

/// The fronts of the lower layers as they would go on where the layers above cut them off. A layer is held as the
/// greater of its own distance and the next layer's, so that its own is known only where it is greater. At nodes
/// within two cells of such ones a plane fitted to them goes on, no higher than the next layer's value; at all others
/// the layer counts as deep inside. The greatest of the continued fronts of a layer and of all above it is that
/// layer's level set.
///
/// \returns by layer but the last one, each with the voxels of the layer's own grid.
/// \note O(n), parallel.
std::vector<GridPtr> continued_fronts(const MaterialStack& stack);

}  // namespace sidewall::levelset
