#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
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

/// \throws RecipeError unless \p sticking, of a species of that name, is one probability or more.
void check_sticking(const std::string& name, const std::vector<double>& sticking);

/// Checks that materials, if there are any, are one a triangle and that each has a sticking probability.
/// \throws GeometryError or RecipeError.
void check_materials(const Species& species, std::span<const std::int32_t> materials, std::size_t triangles);

/// \throws GeometryError unless \p wedges are the mesh's and the box has an area.
void check_fit(const TriangleMesh& mesh, const LateralBox& box, const Wedges& wedges);

}  // namespace sidewall::flux
