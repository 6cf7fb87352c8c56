#pragma once
#include <cstdint>
#include <span>

#include "app/common/timing.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "levelset/motion/advection.hpp"

namespace sidewall::app {

/// Fluxes to speeds on the grid: the motion of the next time step. Voids that the wafer has closed keep their
/// shape in steps without particles.
/// \param everywhere  coarser levels have speeds also where they do not move (levelset::deep_columns), for
///                    columns_of_speed to see.
/// \param left_out    as of levelset::extend.
levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const TracedSurface& surface, Timing& timing, bool everywhere = true,
                                const levelset::LevelColumns* left_out = nullptr);

/// Fluxes and coverages at a point of a triangle, barycentric weights \p u and \p v: first all tallies, then
/// all coverages.
/// \pre \p values has room for both.
void interpolate(const SurfaceFlux& arriving, std::uint32_t triangle, double u, double v,
                 std::span<double> values);

}  // namespace sidewall::app
