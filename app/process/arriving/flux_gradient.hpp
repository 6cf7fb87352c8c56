#pragma once
#include <vector>

#include "app/process/arriving/surface_field.hpp"
#include "app/process/arriving/traced_surface.hpp"

namespace sidewall::app {

/// The name under which a time step's flux gradient is carried on to the next one, among the coverages.
inline constexpr const char* kFluxGradient = "flux_gradient";

/// How steeply the fluxes vary along the traced mesh, by wedge: the largest change of any tally along an edge
/// at the wedge, less three standard errors, as a share of its mean there, a length. 0 where nothing but
/// noise changes.
/// \param mesh      traced.
/// \pre \p arriving was traced there, not carried over.
std::vector<double> flux_gradient(const TriangleMesh& mesh, const SurfaceFlux& arriving);

/// Longest edges, by vertex of \p mesh, along which no flux of the time step before changes by more than \p change
/// of itself; not below \p spacing, infinite where nothing is known. In the mesh's unit.
std::vector<double> resolving_lengths(const SurfaceField& carried, const TriangleMesh& mesh, double change,
                                      double spacing);

}  // namespace sidewall::app
