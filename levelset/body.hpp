#pragma once
#include <functional>

#include "levelset/domain.hpp"
#include "levelset/shapes.hpp"

namespace sidewall::levelset {

/// A shape as a function: negative inside, 1-Lipschitz, zero exactly on the surface.
struct Body {
    std::function<double(const Vec3&)> distance;  ///< world point to world units; safe to call in parallel
    double low = 0.0, high = 0.0;                 ///< z range of the surface
};

/// \p shape in \p domain; on a periodic axis trench, hole, fin and box repeat. A mesh may be closed or open
/// (then the side its normals point to is outside), and its sign is taken from angle-weighted normals
/// (Baerentzen and Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243).
/// \throws GeometryError for lengths that make no body, FileError for a mesh file that cannot be read.
Body make_body(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
