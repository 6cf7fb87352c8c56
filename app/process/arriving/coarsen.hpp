#pragma once
#include "app/common/timing.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The mesh that is traced in place of \p raw, coarsened as [simplify] says. Vertices on periodic sides stay,
/// so that a particle that leaves through one finds the same surface on the opposite one.
/// \param raw      as extracted from \p stack.
/// \param carried  how steeply the fluxes of the time step before vary, see kFluxGradient.
TriangleMesh coarsen(const Recipe& recipe, const levelset::MaterialStack& stack, const TriangleMesh& raw,
                     const SurfaceField& carried, Timing& timing);

/// Whether the fluxes of the time step before bound the lengths of edges.
bool bounds_by_flux(const SimplifySection& section);

}  // namespace sidewall::app
