#pragma once
#include <optional>
#include <vector>

#include "app/common/timing.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/extraction/marching_cubes.hpp"

namespace sidewall::app {

/// Whether a wafer is a profile one cell thick along y. Its meshes are rectangles of two triangles each.
bool is_profile(const levelset::Domain& domain);

/// Extracts the stack's surface, its pieces and the sides of the domain. Traces nothing.
/// \param time   since the step began.
/// \throws NumericsError if no surface is left.
TracedSurface extract(const levelset::MaterialStack& stack, double time, Timing& timing,
                      surface::SharpEdges edges = surface::SharpEdges::all);

/// Whether [simplify] coarsens a surface of so many triangles before the model's species are traced. auto
/// does so if the rays saved (a coarser mesh needs fewer for an equal error) take longer than the coarsening,
/// but never in profiles, and only if all species are neutrals that mostly do not stick: coarser elements
/// flatten fluxes that vary over few cells.
/// \param noise  see TraceRequest.
bool coarsens(const Recipe& recipe, const Model& model, std::size_t triangles, std::optional<double> noise);

/// Simplifies the surface for tracing, if coarsens() and the model traces species. Keeps vertices on sharp
/// edges, and on periodic sides, so that a particle that leaves finds the same surface on the opposite side.
/// \param stack    \p surface was extracted from it.
/// \param noise    see TraceRequest.
/// \param carried  has the flux gradient of the time step before, see kFluxGradient.
void simplify(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
              const SurfaceField& carried, std::optional<double> noise, TracedSurface& surface,
              Timing& timing);

/// By vertex of \p mesh, in its unit: the longest edge along which no flux of the time step before changes by
/// more than the share \p change. At least \p spacing; infinite where nothing is known.
std::vector<double> resolving_lengths(const SurfaceField& carried, const TriangleMesh& mesh,
                                      const flux::LateralBox& box, double change, double spacing);

}  // namespace sidewall::app
