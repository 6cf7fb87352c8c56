#pragma once
#include <optional>
#include <span>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "flux/radiosity/radiosity.hpp"

namespace sidewall::app {

/// Solves for the species of arriving.trace->methods that radiosity takes and puts their fluxes into
/// arriving.trace->species.
///
/// \param sticking  as flux::TraceOptions::sticking_by_wedge; empty: the species' own.
/// \param emission  as flux::TraceOptions::emission_by_wedge; empty: none.
/// \param exchange  of this surface; if empty, it is made, and its rays are gathered. Else they are used
///                  again: none is traced unless [flux] relative_error is not met any more.
/// \param before    report of the trace before, whose fluxes the solver starts from; may be empty.
/// \throws LeakError, Interrupted as trace_species; NumericsError if the balance has no solution.
void solve_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, std::span<const double> emission,
                   const TraceRequest& request, std::optional<flux::Exchange>& exchange,
                   const std::optional<TraceReport>& before, SurfaceFlux& arriving);

/// Seed, memory, progress and ranks of an exchange of the surface.
flux::ExchangeOptions exchange_options(const Recipe& recipe, const TraceRequest& request);

/// Bytes that the rays of a recipe's radiosity may take at most; 0 if it has none.
double radiosity_memory(const FluxSection& flux);

}  // namespace sidewall::app
