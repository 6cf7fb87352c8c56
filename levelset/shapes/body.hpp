#pragma once
#include <functional>

#include "surface/vec3.hpp"

namespace sidewall::levelset {

/// Stands for "through everything": beyond any wafer, small enough for exact arithmetic beside a cell.
inline constexpr double kFar = 1e5;

/// A shape as a function: negative inside, 1-Lipschitz, zero exactly on the surface.
struct Body {
    std::function<double(const Vec3&)> distance;  ///< world point to world units; safe to call in parallel
    double low = 0.0, high = 0.0;                 ///< z range of the surface
    bool closed = false;                          ///< it ends below and may touch other bodies there
};

}  // namespace sidewall::levelset
