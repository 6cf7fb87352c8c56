#pragma once
#include <span>

#include "flux/tracer.hpp"

namespace sidewall::flux {

/// What trace_flux asks of its arguments. \throws RecipeError for a species or options out of range,
/// GeometryError for arrays that do not fit \p mesh.
void check(const TriangleMesh& mesh, const LateralBox& box, const Species& species,
           std::span<const std::int32_t> materials, const Wedges& wedges, const TraceOptions& options);

}  // namespace sidewall::flux
