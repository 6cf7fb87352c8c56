#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "flux/tracer/tracer.hpp"

namespace sidewall::flux {

/// The values by wedge in TraceOptions, separated by species; a span is empty if the options have none.
struct WedgeValues {
    std::vector<std::span<const double>> sticking, emission;
};

/// Checks the arguments of trace_fluxes.
/// \throws RecipeError for a species or options out of range, GeometryError for arrays of wrong length.
WedgeValues check(const TriangleMesh& mesh, const LateralBox& box, std::span<const Species> species,
                  std::span<const std::int32_t> materials, const Wedges& wedges, const TraceOptions& options);

/// Checks that \p sticking, of the species \p name, is one or more probabilities.
/// \throws RecipeError.
void check_sticking(const std::string& name, const std::vector<double>& sticking);

/// Checks that materials, if given, are one a triangle and that each has a sticking probability.
/// \throws GeometryError or RecipeError.
void check_materials(const Species& species, std::span<const std::int32_t> materials, std::size_t triangles);

/// Checks that \p wedges belong to the mesh and that the box has an area.
/// \throws GeometryError.
void check_fit(const TriangleMesh& mesh, const LateralBox& box, const Wedges& wedges);

}  // namespace sidewall::flux
