#pragma once
#include "levelset/advection.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {

/// How far a time step may raise phi in bodies beside the one that it etches: a node in a mask whose nearest
/// surface point is on the silicon that recedes under it moves with that speed, up to cfl dx past the mask's own
/// underside. A body is what lies between one layer's level set and the next. In it phi may rise to the body's
/// old surface and by what the body itself can lose, and at the neighbours by their distance more.
///
/// \param stack     its lower layers as before the time step.
/// \param before    the surface before the time step.
/// \param motion    V, the samples' thicknesses and the bodies' largest etch rates.
/// \param duration  of the time step.
/// \returns the largest phi of each of its voxels, infinite where nothing limits it.
/// \note O(n), parallel.
Grid::TreeType::Ptr limits_of(const MaterialStack& stack, const Grid& before, const Motion& motion,
                              double duration);

/// Lowers phi to the limits, within the band.
void keep_within(Grid& phi, const Grid::TreeType& limits);

}  // namespace sidewall::levelset
