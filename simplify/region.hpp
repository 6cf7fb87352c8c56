#pragma once
#include <cstdint>
#include <span>

#include "simplify/simplify_options.hpp"
#include "simplify/simplify_result.hpp"

namespace sidewall::simplify {

/// Coarsens \p mesh away from its features, ring by ring (Lenz 2023, section 8.2): the whole mesh with edge
/// length l0; then, outside of the feature region, with l0 + step; then the region takes in its neighbours,
/// the length grows by options.step again, and so on, until it reaches l_max or nothing collapses although an
/// edge is short enough. An edge belongs to the transition region if neither end is in the feature region.
/// Vertices where materials meet count as features that l0 does not touch either.
///
/// \param mesh      orientable manifold, open or closed; its boundary, material borders, orientation and
///                  Euler number are kept as CollapseEngine says.
/// \param features  one flag a vertex: true keeps the resolution l0 there; with l0 = 0 such vertices stay bit
///                  for bit.
/// \returns the simplified mesh and how many vertices each pass removed.
/// \throws GeometryError on another mesh, or if \p features has another length than the vertices; RecipeError
///         on options out of range, options.step below a thousandth of the mean edge included.
/// \note O(n) a pass; deterministic for a given mesh, whatever the number of threads.
Result simplify_regions(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                        const RegionOptions& options);

}  // namespace sidewall::simplify
