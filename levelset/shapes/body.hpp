#pragma once
#include <functional>

#include "levelset/domain.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// Stands for "through everything": beyond any wafer, small enough for exact arithmetic beside a cell.
inline constexpr double kFar = 1e5;

/// A shape as a function: negative inside, 1-Lipschitz, zero exactly on the surface.
struct Body {
    std::function<double(const Vec3&)> distance;  ///< world point to world units; safe to call in parallel
    double low = 0.0, high = 0.0;                 ///< z range of the surface
    bool closed = false;                          ///< it ends below and may touch other bodies there
};

/// \p shape in \p domain; all but a mesh repeat on a periodic axis. One that is to be subtracted is the body that
/// goes: the opening of a trench, hole or mask from its depth up, or what lies above an open profile; else what the
/// shape is without a wafer below. A mesh may be closed or open
/// (then the side its normals point to is outside), and its sign is taken from angle-weighted normals
/// (Baerentzen and Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243).
/// \throws GeometryError for lengths that make no body, FileError for a mesh file that cannot be read.
Body make_body(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
