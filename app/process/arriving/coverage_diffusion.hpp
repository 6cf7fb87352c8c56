#pragma once
#include <vector>

#include "app/process/arriving/coverages.hpp"

namespace sidewall::app {

/// Lets the coverages that diffuse react and spread along the traced surface together: backward Euler in time, reactions
/// linear in the coverage (Rosenbrock's first stage), so that long time steps lead to the steady state of both; finite elements on
/// the traced triangles. What diffuses passes creases and sides that are periodic, not reflective ones nor the edge of a
/// material that it does not diffuse on.
/// \param arriving  fluxes, and coverages before.
/// \param after  by coverage and wedge: what reactions alone make of them; diffusing ones are replaced where they diffuse.
/// \throws NumericsError where D or the rates have no value, with the expression.
void diffuse_coverages(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving,
                       const WedgePoints& points, double time, std::vector<std::vector<double>>& after);

}  // namespace sidewall::app
