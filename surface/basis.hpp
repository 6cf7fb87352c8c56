#pragma once
#include <cmath>
#include <utility>

#include "surface/vec3.hpp"

namespace sidewall {

/// The components of two vectors s and t.
template <class Real>
struct Tangents {
    Real sx, sy, sz, tx, ty, tz;
};

/// Unit vectors s, t that complete the unit vector n to a right-handed orthonormal basis (s, t, n). Duff et
/// al., Building an orthonormal basis, revisited, JCGT 6 (2017): no branch, and no loss of digits near
/// n.z = -1. Works on plain numbers so that compilers vectorise loops in single precision.
/// \param nx, ny, nz  components of n.
/// \param sign        1 where nz is positive, -1 where it is negative; either is right at or near 0.
template <class Real>
constexpr Tangents<Real> tangents_of(Real nx, Real ny, Real nz, Real sign) {
    const Real a = Real(-1) / (sign + nz), b = nx * ny * a;
    return {Real(1) + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny};
}

/// tangents_of() for the vector \p n, returned as vectors.
inline std::pair<Vec3, Vec3> basis_around(const Vec3& n) {
    const auto [sx, sy, sz, tx, ty, tz] = tangents_of(n.x(), n.y(), n.z(), std::copysign(1.0, n.z()));
    return {Vec3(sx, sy, sz), Vec3(tx, ty, tz)};
}

}  // namespace sidewall
