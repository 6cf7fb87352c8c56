#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "flux/tracer/tracer.hpp"

namespace sidewall::flux {

/// What trace_flux asks of its arguments.
/// \param sticking_by_wedge  the species' own, or empty.
/// \throws RecipeError for a species or options out of range, GeometryError for arrays that do not fit \p
///         mesh.
void check(const TriangleMesh& mesh, const LateralBox& box, const Species& species,
           std::span<const double> sticking_by_wedge, std::span<const std::int32_t> materials,
           const Wedges& wedges, const TraceOptions& options);

/// The part of options.sticking_by_wedge that is each species'; all empty if it is.
/// \throws GeometryError unless it has a value for each on every wedge.
std::vector<std::span<const double>> sticking_of_each(std::size_t species, const Wedges& wedges,
                                                      const TraceOptions& options);

/// The part of options.emission_by_wedge that is each species'; all empty if it is.
/// \throws GeometryError unless it has a value for each on every wedge; RecipeError if one is not finite or below 0.
std::vector<std::span<const double>> emission_of_each(std::span<const Species> species, const Wedges& wedges,
                                                      const TraceOptions& options);

}  // namespace sidewall::flux
