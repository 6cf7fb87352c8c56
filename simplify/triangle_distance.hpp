#pragma once
#include "surface/vec3.hpp"

namespace sidewall::simplify {

/// Squared distance from the origin to the triangle a, b, c. Ericson, Real-Time Collision Detection, 2005,
/// section 5.1.5.
inline double distance2_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a;
    const double d1 = -ab.dot(a), d2 = -ac.dot(a);
    if (d1 <= 0.0 && d2 <= 0.0) return a.squaredNorm();
    const double d3 = -ab.dot(b), d4 = -ac.dot(b);
    if (d3 >= 0.0 && d4 <= d3) return b.squaredNorm();
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return (a + d1 / (d1 - d3) * ab).squaredNorm();
    const double d5 = -ab.dot(c), d6 = -ac.dot(c);
    if (d6 >= 0.0 && d5 <= d6) return c.squaredNorm();
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return (a + d2 / (d2 - d6) * ac).squaredNorm();
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
        return (b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).squaredNorm();
    // The point itself, not the plane: of a triangle next to none the plane is noise, a point of it is not.
    const double sum = va + vb + vc;
    return (a + vb / sum * ab + vc / sum * ac).squaredNorm();
}

}  // namespace sidewall::simplify
