#pragma once
#include <span>

#include "flux/radiosity/radiosity.hpp"

namespace sidewall::flux {

/// Importance sampling: further gathers of \p exchange start their rays where they lower the relative errors of all
/// \p fluxes most, by adjoint solutions on the rays so far. Traces no ray.
void set_importance(Exchange& exchange, std::span<const DiffuseSpecies> species,
                    std::span<const RadiosityFlux> fluxes, const SolveOptions& options = {});

/// Further gathers place their residual rays, which measure the elements' error, where slopes of \p fluxes change.
void place_residual_rays(Exchange& exchange, std::span<const RadiosityFlux> fluxes);

}  // namespace sidewall::flux
