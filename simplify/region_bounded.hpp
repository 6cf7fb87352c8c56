#pragma once
#include <cstdint>
#include <span>

#include "simplify/simplify_options.hpp"
#include "simplify/simplify_result.hpp"

namespace sidewall::simplify {

/// A region simplification that is safe where features are missed: every edge keeps to options.max_error, and
/// the length allowed to it grows with its distance to the nearest feature, by options.step an edge from
/// l0 at the feature itself, up to l_max, and is nowhere more than max_length_at. Within these bounds the
/// cheapest edge goes first, all over the mesh at once. With a target vertex count the bounds start tight,
/// below a hundredth of l0 + step for the error, and all but max_error and max_length_at are relaxed where
/// they stand in the way of the target: the vertices that are left go where the surface needs them.
///
/// \param features  one flag a vertex, as in simplify_regions; may be empty: then only max_error and max_length_at bound.
/// \returns the simplified mesh; its passes are the rounds of relaxation, their lengths those allowed
///          farthest from features, infinite where nothing bounds them.
/// \throws as simplify_regions does; also if max_length_at has another length than the vertices.
/// \note O(n) a round; deterministic for a given mesh, whatever the number of threads.
Result simplify_regions_bounded(const TriangleMesh& mesh, std::span<const std::uint8_t> features,
                                const RegionOptions& options);

}  // namespace sidewall::simplify
