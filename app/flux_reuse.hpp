#pragma once
#include "app/surface_flux.hpp"

namespace sidewall::app {

/// For how long the fluxes of the last trace will do; part of the run's state.
struct FluxReuse {
    std::uint32_t left = 0;   ///< time steps still to be made with them
    std::uint32_t since = 0;  ///< time steps made with them
};

/// Names under which fluxes and coverages of a model are carried on: flux_*, then its coverages.
std::vector<std::string> carried_names(const Model& model);

/// Fluxes and coverages by wedge, in that order.
std::vector<std::vector<double>> carried_values(const SurfaceFlux& surface);

/// Fluxes and coverages as a field on the traced mesh, by carried_names.
CoverageField flux_field(const Model& model, const SurfaceFlux& surface);

/// The surface's fluxes and coverages become those of the closest points of \p field.
/// \pre it has its wedges.
void take_fluxes(const Model& model, const CoverageField& field, SurfaceFlux& surface);

/// How much the fluxes have changed since \p field was traced: the mean difference over the surface as a
/// share of the mean flux, the most of all tallies, with the part that the standard errors explain taken out.
double flux_change(const Model& model, const CoverageField& field, const SurfaceFlux& surface);

/// How many time steps more the fluxes will stay within \p tolerance, if they go on changing by \p change
/// every \p since time steps; no more than 8.
std::uint32_t steps_within(double tolerance, double change, std::uint32_t since);

}  // namespace sidewall::app
