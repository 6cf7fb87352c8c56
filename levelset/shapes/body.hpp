#pragma once
#include <algorithm>
#include <functional>

#include "levelset/domain.hpp"
#include "surface/vec3.hpp"

namespace sidewall::levelset {

/// A length beyond most wafers, world units.
inline constexpr double kFar = 1e5;

/// Where unbounded shapes end: beyond the wafer's sides, and else at most 1e6 grid spacings away, for precision, as
/// lengths may be in m.
inline double far_away(const Domain& domain) {
    constexpr double kCells = 1e6, kWafers = 4.0;
    const double across = domain.max[0] - domain.min[0] + domain.max[1] - domain.min[1];
    return std::max(std::min(kFar, kCells * domain.spacing), kWafers * across);
}

/// A shape as a function: negative inside, 1-Lipschitz, zero exactly on the surface.
struct Body {
    std::function<double(const Vec3&)> distance;  ///< world point to world units; safe to call in parallel
    double low = 0.0, high = 0.0;                 ///< z range of the surface
    bool closed = false;                          ///< bounded below, where it may touch other bodies
};

}  // namespace sidewall::levelset
