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
levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const TracedSurface& surface, Timing& timing, bool everywhere = true);

/// Fluxes and coverages at a point of a triangle, barycentric weights \p u and \p v: first all tallies, then
/// all coverages.
/// \pre \p values has room for both.
void interpolate(const SurfaceFlux& arriving, std::uint32_t triangle, double u, double v,
                 std::span<double> values);

/// Whether a straight line from a surface point towards \p direction (unit, upwards) meets no surface; it is
/// mirrored or goes on periodically at the sides.
/// \pre the surface has its scene, or its columns if the direction is straight upwards.
bool visible(const TracedSurface& surface, const Vec3& point, const Vec3& normal, const Vec3& direction,
             double spacing);

}  // namespace sidewall::app
