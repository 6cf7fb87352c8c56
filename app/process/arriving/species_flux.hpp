#pragma once
#include <optional>
#include <span>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"
#include "flux/radiosity/radiosity.hpp"
#include "surface/error.hpp"

namespace sidewall::app {

/// More particles leak through the surface than rounding explains.
struct LeakError : NumericsError {
    using NumericsError::NumericsError;
};

/// What the turns of a surface's coverages share, so that nothing is traced twice.
struct SharedTraces {
    std::vector<SpeciesMethod> methods;  ///< by species
    std::optional<flux::Exchange>
        exchange;  ///< rays between points of the surface; empty before the first turn
    std::vector<double> sticking, emission;  ///< of the turn before
};

/// Traces every species of \p model on \p surface, which has its meshes, box and scene: sets the fluxes of
/// \p arriving as models see them, less their noise and averaged as the recipe says, and its trace. Species
/// that radiosity takes are solved for on rays that are gathered in the first turn; others that stick as in
/// the turn before keep its fluxes, which are those that another trace would give.
/// \param sticking   as flux::TraceOptions::sticking_by_wedge; empty: the species' own.
/// \param emission   as flux::TraceOptions::emission_by_wedge; empty: none.
/// \param shared     has its methods; the rest is for further calls with this surface.
/// \param arriving   has the materials and wedges of the traced mesh, and the trace of the turn before.
/// \throws LeakError; Interrupted if the user asked to stop.
void trace_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, std::span<const double> emission,
                   const TraceRequest& request, SharedTraces& shared, SurfaceFlux& arriving);

}  // namespace sidewall::app
