#pragma once
#include <array>
#include <cstddef>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// How well shaped the triangles of a mesh are. Degenerate triangles count with angle 0 and mean ratio 0.
struct Quality {
    double min_angle_deg = 0.0;
    double max_angle_deg = 0.0;
    double mean_ratio_min = 0.0;
    double mean_ratio_mean = 0.0;
    std::size_t slivers = 0;     ///< triangles with an angle below 5 degrees, degenerate ones included
    std::size_t degenerate = 0;  ///< triangles of zero area
};

/// Mean ratio of a triangle: 4 sqrt(3) area / sum of squared edge lengths; 1 if equilateral, 0 if degenerate.
/// Knupp, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23 (2001) 193.
double mean_ratio(const Vec3& a, const Vec3& b, const Vec3& c);

/// The three inner angles in radians, at a, b and c; all zero if two vertices coincide.
std::array<double, 3> inner_angles(const Vec3& a, const Vec3& b, const Vec3& c);

/// Quality over all triangles; all zero for an empty mesh. O(n).
Quality measure_quality(const TriangleMesh& mesh);

}  // namespace sidewall::surface
