#pragma once
#include <cmath>
#include <utility>

#include "surface/vec3.hpp"

namespace sidewall {

/// Two unit vectors s, t that complete the unit vector \p n to a right-handed orthonormal basis (s, t, n).
/// Duff et al., Building an orthonormal basis, revisited, JCGT 6 (2017): no branch, and no loss of digits near
/// n.z = -1.
inline std::pair<Vec3, Vec3> basis_around(const Vec3& n) {
    const double sign = std::copysign(1.0, n.z());
    const double a = -1.0 / (sign + n.z());
    const double b = n.x() * n.y() * a;
    return {Vec3(1.0 + sign * n.x() * n.x() * a, sign * b, -sign * n.x()),
            Vec3(b, sign + n.y() * n.y() * a, -n.y())};
}

}  // namespace sidewall
