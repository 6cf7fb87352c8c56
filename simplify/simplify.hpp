#pragma once
#include <cstdint>
#include <span>

#include "simplify/simplify_options.hpp"
#include "simplify/simplify_result.hpp"

namespace sidewall::simplify {

/// Coarsens \p mesh by the method and lengths of \p options; "auto" comes from the grid spacing or the mesh.
///
/// \param features  one flag a vertex; only the region methods read them, the others take an empty span.
/// \returns the mesh, the vertices each pass removed and the seconds taken (not those for finding features).
/// \throws RecipeError for values out of range and for max_error with CGAL's method; GeometryError as
///         simplify_regions does.
Result simplify(const TriangleMesh& mesh, std::span<const std::uint8_t> features, const Options& options);

}  // namespace sidewall::simplify
