#pragma once
#include <span>

#include "app/process/traced_surface.hpp"
#include "surface/error.hpp"

namespace sidewall::app {

/// More particles leak through the surface than rounding explains.
struct LeakError : NumericsError {
    using NumericsError::NumericsError;
};

/// Traces every species of \p model on \p surface, which has its meshes, box and scene: sets the fluxes of
/// \p arriving as models see them, less their noise and averaged as the recipe says, and its trace.
/// \param sticking   as flux::TraceOptions::sticking_by_wedge; empty: the species' own.
/// \param arriving   has the materials and wedges of the traced mesh.
/// \throws LeakError; Interrupted if the user asked to stop.
void trace_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, const TraceRequest& request, SurfaceFlux& arriving);

}  // namespace sidewall::app
