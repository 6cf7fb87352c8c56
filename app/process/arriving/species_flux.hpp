#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "flux/radiosity/radiosity.hpp"

namespace sidewall::app {

/// What the repeated traces of a surface share, so that nothing is traced twice.
struct SharedTraces {
    std::vector<SpeciesMethod> methods;  ///< by species
    std::vector<std::vector<std::size_t>>
        passes;                                   ///< of the species that Monte Carlo traces, by their places
    std::optional<flux::Exchange> exchange = {};  ///< radiosity's rays; empty before the first trace
    std::vector<double> sticking = {}, emission = {};  ///< of the trace before
};

/// What the traces of a surface share before the first one.
SharedTraces shared_traces(const Model& model, std::vector<SpeciesMethod> methods);

/// Traces every species of \p model on \p surface, which has its meshes, box and scene: sets the fluxes of
/// \p arriving as models see them, less their noise and averaged as the recipe says, and its trace. Species
/// that radiosity takes are solved for on rays that are gathered in the first trace; others that stick as in
/// the trace before keep its fluxes, which another trace would only repeat.
/// \param sticking   as flux::TraceOptions::sticking_by_wedge; empty: the species' own.
/// \param emission   as flux::TraceOptions::emission_by_wedge; empty: none.
/// \param shared     from shared_traces, then from call to call with this surface.
/// \param arriving   has the materials and wedges of the traced mesh, and the trace before.
/// \throws LeakError; Interrupted if the user asked to stop.
void trace_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, std::span<const double> emission,
                   const TraceRequest& request, SharedTraces& shared, SurfaceFlux& arriving);

/// Adds what comes straight from the sources, which is computed anew, to fluxes without it that were carried over.
void add_direct_parts(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                      SurfaceFlux& arriving);

/// What a Monte Carlo trace takes from the recipe.
flux::TraceOptions trace_options(const Recipe& recipe, const TraceRequest& request);

}  // namespace sidewall::app
