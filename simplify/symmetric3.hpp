#pragma once
#include "surface/vec3.hpp"

namespace sidewall::simplify {

/// A symmetric 3 x 3 matrix in six numbers.
struct Symmetric3 {
    double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

    /// Adds \p s v v^T.
    void add_outer(const Vec3& v, double s) {
        const double x = s * v.x(), y = s * v.y(), z = s * v.z();
        xx += x * v.x(), xy += x * v.y(), xz += x * v.z();
        yy += y * v.y(), yz += y * v.z(), zz += z * v.z();
    }
    /// Adds \p s times the matrix of v -> u x (v x u): |u|^2 I - u u^T.
    void add_cross(const Vec3& u, double s) {
        const double square = s * u.squaredNorm();
        add_outer(u, -s);
        xx += square, yy += square, zz += square;
    }
    void add(const Symmetric3& m, double s = 1.0) {
        xx += s * m.xx, xy += s * m.xy, xz += s * m.xz;
        yy += s * m.yy, yz += s * m.yz, zz += s * m.zz;
    }
    double trace() const { return xx + yy + zz; }
    Vec3 operator*(const Vec3& v) const {
        return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
                xz * v.x() + yz * v.y() + zz * v.z()};
    }
};

}  // namespace sidewall::simplify
