#pragma once
#include <utility>
#include <vector>

#include "levelset/advection.hpp"

namespace sidewall::levelset {

/// The limits of phi at some nodes of one leaf, by their place in it.
struct LeafLimits {
    openvdb::Coord origin;
    std::vector<std::pair<openvdb::Index, float>> limits;
};

/// How far a step may raise phi beside the body that it etches. A node in a mask whose nearest surface point is
/// on the silicon that recedes under it moves with that, and would be carried up to cfl dx past the mask's own
/// underside. So no node may come to lie nearer to the gas than another body's old surface and its own etch rate
/// allow, nor its neighbours by more than the distance to it.
/// \param before  the surface as the step finds it; the layers below are as they were, too.
/// \note O(n), parallel.
std::vector<LeafLimits> limits_of(const MaterialStack& stack, const Grid& before, const Motion& motion,
                                  double duration);

/// Lowers phi to the limits, within the band.
void keep_within(Grid& phi, const std::vector<LeafLimits>& limits);

}  // namespace sidewall::levelset
