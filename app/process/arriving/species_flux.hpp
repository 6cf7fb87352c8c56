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

/// What repeated traces of one surface share, so that nothing is traced twice.
struct SharedTraces {
    std::vector<SpeciesMethod> methods;                ///< by species
    std::vector<std::vector<std::size_t>> passes;      ///< Monte Carlo passes, of indices of species
    std::optional<flux::Exchange> exchange = {};       ///< radiosity's rays; none before the first trace
    std::vector<double> sticking = {}, emission = {};  ///< as in the trace before
};

/// The shared data before the first trace of a surface.
SharedTraces shared_traces(const Model& model, std::vector<SpeciesMethod> methods);

/// Traces every species of \p model on \p surface, which has its meshes, box and scene. Sets arriving.trace,
/// and arriving.flux as models see it: smoothed, and averaged as the recipe says. Radiosity solves for its
/// species on rays gathered in the first trace. Passes with unchanged sticking and emission keep their
/// fluxes.
/// \param sticking   as flux::TraceOptions::sticking_by_wedge; empty: the species' own.
/// \param emission   as flux::TraceOptions::emission_by_wedge; empty: none.
/// \param shared     from shared_traces; the same object in all calls for this surface.
/// \param arriving   with materials and wedges of the traced mesh, and the trace before if any.
/// \throws LeakError; Interrupted if the user asked to stop.
void trace_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, std::span<const double> emission,
                   const TraceRequest& request, SharedTraces& shared, SurfaceFlux& arriving);

/// Adds the direct fluxes of the sources, computed for this surface, to carried fluxes without them.
void add_direct_parts(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                      SurfaceFlux& arriving);

/// Options of a Monte Carlo trace for a recipe.
flux::TraceOptions trace_options(const Recipe& recipe, const TraceRequest& request);

}  // namespace sidewall::app
