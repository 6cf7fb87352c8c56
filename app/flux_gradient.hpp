#pragma once
#include <span>
#include <vector>

#include "app/coverage.hpp"
#include "app/surface_flux.hpp"

namespace sidewall::app {

/// The name under which a step's flux gradient is carried on to the next one, among the coverages.
inline constexpr const char* kFluxGradient = "flux_gradient";

/// How steeply the fluxes vary along the traced mesh, by wedge: the largest change of any tally along an edge
/// at the wedge, less three standard errors, as a share of its mean there, a length. 0 where nothing but
/// noise changes.
std::vector<double> flux_gradient(const SurfaceFlux& surface);

/// Longest edges, by vertex of \p mesh, along which no flux of the step before changes by more than \p change
/// of itself; not below \p spacing, infinite where nothing is known. In the mesh's unit.
std::vector<double> resolving_lengths(const CoverageField& carried, const TriangleMesh& mesh, double change,
                                      double spacing);

}  // namespace sidewall::app
