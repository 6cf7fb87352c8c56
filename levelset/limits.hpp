#pragma once
#include "levelset/advection.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {

/// How far a step may raise phi beside the body that it etches. A node in a mask whose nearest surface point is
/// on the silicon that recedes under it moves with that, and would be carried up to cfl dx past the mask's own
/// underside. So no node may come to lie nearer to the gas than another body's old surface and its own etch rate
/// allow, nor its neighbours by more than the distance to it.
/// \param before  the surface as the step finds it; the layers below are as they were, too.
/// \returns the largest phi of each of its voxels, infinite where nothing limits it.
/// \note O(n), parallel.
Grid::TreeType::Ptr limits_of(const MaterialStack& stack, const Grid& before, const Motion& motion,
                              double duration);

/// Lowers phi to the limits, within the band.
void keep_within(Grid& phi, const Grid::TreeType& limits);

}  // namespace sidewall::levelset
