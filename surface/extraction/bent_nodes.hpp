#pragma once
#include "surface/extraction/cut_leaves.hpp"

namespace sidewall::surface {

/// The nodes of leaf \p n where a second difference of the values along an axis exceeds a fifth of the grid
/// spacing, as beside the bisecting planes of the surface's edges. Shallow edges may be missed.
NodeBits bent_nodes(const CutLeaves& leaves, const LateralGrid& box, std::size_t n);

}  // namespace sidewall::surface
