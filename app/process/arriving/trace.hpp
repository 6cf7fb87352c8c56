#pragma once
#include "app/common/timing.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// Traces the model's species on the surface and lets the coverages react, alternately: fluxes depend on the
/// sticking that coverages leave, coverages on the fluxes. If the model traces nothing, builds the scene or
/// columns that its speed needs, if any.
///
/// Steady coverages are iterated until they have settled if request.settle is set, else traced once. A pulse
/// is traced in parts, from a bare surface. All iterations use the same random numbers, so that their
/// differences are not noise. Methods not yet chosen are chosen by the initial sticking, and again by that of
/// the settled coverages. If a simplified mesh leaks, the surface as extracted is traced instead; if that
/// leaks, one without sharp edges.
/// \param stack    \p surface was extracted from it.
/// \param carried  from field_to_carry of the surface before; coverages that it lacks begin at 0.
/// \throws NumericsError if particles leak even then, or ranks have different surfaces; Interrupted if the
///         user asked to stop.
void trace(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
           const SurfaceField& carried, const TraceRequest& request, TracedSurface& surface, Timing& timing);

/// Runs the phases extract, simplify (if the model traces species) and trace.
/// \throws as they do.
TracedSurface trace_surface(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                            const SurfaceField& carried, const TraceRequest& request, Timing& timing);

/// Gives the extracted surface fluxes and coverages of an earlier one's closest points, instead of tracing.
/// \param carried  from field_to_carry with [flux] reuse.
/// \pre the model traces species.
void reuse_fluxes(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
                  const SurfaceField& carried, TracedSurface& surface, Timing& timing);

}  // namespace sidewall::app
