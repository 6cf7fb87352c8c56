#pragma once
#include <span>
#include <vector>

#include "flux/tracer/tracer.hpp"

namespace sidewall::flux {

/// The values by wedge of TraceOptions divided by species; each is empty if the options have none.
struct WedgeValues {
    std::vector<std::span<const double>> sticking, emission;
};

/// Checks the arguments of trace_fluxes.
/// \throws RecipeError for a species or options out of range, GeometryError for arrays that do not fit \p mesh.
WedgeValues check(const TriangleMesh& mesh, const LateralBox& box, std::span<const Species> species,
                  std::span<const std::int32_t> materials, const Wedges& wedges, const TraceOptions& options);

}  // namespace sidewall::flux
