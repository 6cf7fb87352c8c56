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

/// Whether a wafer is one cell thick along y: the triangles of its meshes are pairs, rectangles between its two sides.
bool is_profile(const levelset::Domain& domain);

/// Extracts the stack's surface, with its pieces and the sides of the domain. Nothing is traced yet.
/// \param time   since the step began.
/// \throws NumericsError if nothing is left of it.
TracedSurface extract(const levelset::MaterialStack& stack, double time, Timing& timing,
                      surface::SharpEdges edges = surface::SharpEdges::all);

/// Whether [simplify] coarsens a surface of so many triangles before the model's species are traced. auto does so
/// where rays are so many for its triangles that the fewer ones which a coarsened mesh needs to an equal error spare more
/// time than it takes to make it, and only in space where all species are neutrals that mostly do not stick: coarser elements
/// flatten fluxes that vary over few cells.
/// \param noise  see TraceRequest.
bool coarsens(const Recipe& recipe, const Model& model, std::size_t triangles, std::optional<double> noise);

/// Sets the mesh that is traced in place of the surface as extracted, if [simplify] coarsens it and the model traces
/// anything. Vertices on periodic sides stay, so that a particle that
/// leaves through one finds the same surface on the opposite one, and so do those on sharp edges.
/// \param stack    that \p surface was extracted from.
/// \param noise    see TraceRequest.
/// \param carried  how steeply the fluxes of the time step before vary, see kFluxGradient.
void simplify(const Recipe& recipe, const Model& model, const levelset::MaterialStack& stack,
              const SurfaceField& carried, std::optional<double> noise, TracedSurface& surface,
              Timing& timing);

/// Longest edges, by vertex of \p mesh, along which no flux of the time step before changes by more than \p change
/// of itself; not below \p spacing, infinite where nothing is known. In the mesh's unit.
std::vector<double> resolving_lengths(const SurfaceField& carried, const TriangleMesh& mesh, double change,
                                      double spacing);

}  // namespace sidewall::app
