#pragma once
#include "app/process/arriving/traced_surface.hpp"

namespace sidewall::app {

/// For how many time steps the fluxes of the last trace serve; part of the run's state.
struct FluxReuse {
    std::uint32_t left = 0;   ///< time steps still to be made with them
    std::uint32_t since = 0;  ///< time steps made with them
};

/// Names under which fluxes and coverages of a model are carried on: flux_*, then its coverages.
std::vector<std::string> carried_names(const Model& model);

/// Fluxes and coverages by wedge, in that order.
std::vector<std::vector<double>> carried_values(const SurfaceFlux& arriving);

/// Fluxes and coverages as a field on the traced mesh, by carried_names.
/// \pre the surface has fluxes.
SurfaceField flux_field(const Model& model, const TracedSurface& surface);

/// The fluxes and coverages of the closest points of \p field.
/// \param parts  materials and wedges of \p mesh.
/// \returns \p parts with fluxes and coverages.
SurfaceFlux carried_fluxes(const Model& model, const SurfaceField& field, const TriangleMesh& mesh,
                           SurfaceFlux parts);

/// How much the fluxes have changed since \p field was traced: the mean difference over the surface as a
/// share of the mean flux, the most of all tallies, with the part that the standard errors explain taken out.
/// \pre the surface was traced.
double flux_change(const Model& model, const SurfaceField& field, const TracedSurface& surface);

/// How many time steps more the fluxes will stay within \p tolerance, if they go on changing by \p change
/// every \p since time steps; no more than 8.
std::uint32_t time_steps_within(double tolerance, double change, std::uint32_t since);

/// For how many time steps more the fluxes just used serve: \p reuse counted down if they were carried over; after a trace
/// as many time steps as their change since the last one allows.
/// \param tolerance  [flux] reuse.
/// \param before     fluxes of the trace before; null at the start of a step of the recipe, where nothing
///                   is known yet of how fast they change.
FluxReuse next_reuse(double tolerance, const Model& model, const FluxReuse& reuse, const SurfaceField* before,
                     const TracedSurface& surface);

}  // namespace sidewall::app
