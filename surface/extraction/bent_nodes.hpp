#pragma once
#include "surface/extraction/cut_leaves.hpp"

namespace sidewall::surface {

/// The nodes of leaf \p n where a second difference of the values along an axis is over a fifth of the grid spacing, as it is
/// beside the planes at which the surface's angles are halved; gentle angles may be missed.
NodeBits bent_nodes(const CutLeaves& leaves, const LateralGrid& box, std::size_t n);

}  // namespace sidewall::surface
