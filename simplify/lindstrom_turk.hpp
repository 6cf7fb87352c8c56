#pragma once
#include "simplify/simplify_options.hpp"
#include "simplify/simplify_result.hpp"

namespace sidewall::simplify {

/// Coarsens \p mesh everywhere by the same rule: cheapest edge first (Lindstrom and Turk 1998), until the
/// target or the edge length is reached, or nothing more can go. A collapse that would leave a peak of the
/// input far behind waits until others cost as much; see witness.hpp.
///
/// \param mesh  orientable manifold, open or closed; its boundary, material borders, orientation and Euler
///              number are kept as CollapseEngine says.
/// \throws GeometryError on another mesh, RecipeError on options out of range.
/// \note O(n); deterministic for a given mesh, whatever the number of threads.
Result simplify_lindstrom_turk(const TriangleMesh& mesh, const LindstromTurkOptions& options);

}  // namespace sidewall::simplify
