#pragma once
#include <optional>
#include <span>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "flux/radiosity/radiosity.hpp"

namespace sidewall::app {

/// Solves for the species that arriving.trace->methods assigns to radiosity, and stores their fluxes in
/// arriving.trace->species.
///
/// \param sticking  as flux::TraceOptions::sticking_by_wedge; empty: the species' own.
/// \param emission  as flux::TraceOptions::emission_by_wedge; empty: none.
/// \param exchange  of this surface; made here, with its rays, if empty. Else its rays are used again; more
///                  are gathered only if [flux] relative_error is no longer met.
/// \param before    report of the trace before, whose fluxes start the solver; may be empty.
/// \throws LeakError, Interrupted as trace_species; NumericsError if the balance has no solution.
void solve_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, std::span<const double> emission,
                   const TraceRequest& request, std::optional<flux::Exchange>& exchange,
                   const std::optional<TraceReport>& before, SurfaceFlux& arriving);

/// Options of a surface's exchange: seed, memory, progress and ranks.
flux::ExchangeOptions exchange_options(const Recipe& recipe, const TraceRequest& request);

/// Most bytes that the rays of radiosity may take in a recipe; 0 without radiosity.
double radiosity_memory(const FluxSection& flux);

}  // namespace sidewall::app
