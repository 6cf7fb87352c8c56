#pragma once
#include <cstdint>
#include <span>

#include "app/common/timing.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "levelset/motion/advection.hpp"

namespace sidewall::app {

/// The motion of the next time step, from the fluxes: speeds at the grid's surface samples. In steps without
/// particles, closed voids keep their shape.
/// \param everywhere  give coarser levels speeds also where finer levels move for them
///                    (levelset::deep_columns); columns_of_speed needs them.
/// \param left_out    as of levelset::extend.
levelset::Motion surface_motion(const Model& model, const levelset::MaterialStack& stack,
                                const TracedSurface& surface, Timing& timing, bool everywhere = true,
                                const levelset::LevelColumns* left_out = nullptr);

/// Interpolates all fluxes, then all coverages, to a triangle's point with barycentric weights \p u and \p v.
/// \pre \p values has room for all of them.
void interpolate(const SurfaceFlux& arriving, std::uint32_t triangle, double u, double v,
                 std::span<double> values);

}  // namespace sidewall::app
