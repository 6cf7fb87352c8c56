#pragma once
#include "app/common/timing.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// Traces the model's species on the surface and lets the coverages react, in turn: fluxes depend on the
/// sticking that coverages leave, coverages on the fluxes. Where the model traces nothing, it is given the
/// scene or columns that its speed asks for, if any.
///
/// Steady coverages are repeated until they have settled if request.settle asks for it, else traced once; a
/// pulse is traced in its parts, from a bare surface. All repetitions use the same random numbers, so that
/// what is left of a change is not noise. Methods that are to be chosen are by the sticking at the beginning,
/// and once more by what the coverages have left when they have settled. A simplified mesh that leaks is
/// replaced by the surface as extracted.
/// \param stack    that \p surface was extracted from.
/// \param carried  of the surface before, from field_to_carry; coverages of the model's that it lacks begin
///                 at 0.
/// \throws NumericsError if particles leak through the surface as extracted, or ranks have come to different
///         ones; Interrupted if the user asked to stop.
void trace(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
           const SurfaceField& carried, const TraceRequest& request, TracedSurface& surface, Timing& timing);

/// The phases extract, simplify (if the model traces species) and trace in a row.
/// \throws as they do.
TracedSurface trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                            const SurfaceField& carried, const TraceRequest& request, Timing& timing);

/// Gives the surface as extracted the fluxes and coverages of an earlier one, in place of a trace: those of the
/// closest points.
/// \param carried  from field_to_carry with [flux] reuse.
/// \pre the model traces species.
void reuse_fluxes(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                  const SurfaceField& carried, TracedSurface& surface, Timing& timing);

}  // namespace sidewall::app
