#include "surface/quality.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sidewall::surface {

double mean_ratio(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double area = 0.5 * (b - a).cross(c - a).norm();
    const double squares = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    return squares > 0.0 ? 4.0 * std::numbers::sqrt3 * area / squares : 0.0;
}

std::array<double, 3> inner_angles(const Vec3& a, const Vec3& b, const Vec3& c) {
    if (a == b || b == c || c == a) return {0.0, 0.0, 0.0};
    // atan2 keeps its digits at angles near 0 and pi, where acos loses half of them.
    const double twice_area = (b - a).cross(c - a).norm();
    return {std::atan2(twice_area, (b - a).dot(c - a)), std::atan2(twice_area, (c - b).dot(a - b)),
            std::atan2(twice_area, (a - c).dot(b - c))};
}

Quality measure_quality(const TriangleMesh& mesh) {
    Quality quality;
    if (mesh.triangles.empty()) return quality;
    constexpr double kDegrees = 180.0 / std::numbers::pi;
    quality.min_angle_deg = 180.0;
    quality.mean_ratio_min = 1.0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
        const auto angles = inner_angles(p, q, r);
        const auto [low, high] = std::minmax_element(angles.begin(), angles.end());
        const double ratio = mean_ratio(p, q, r);
        quality.min_angle_deg = std::min(quality.min_angle_deg, *low * kDegrees);
        quality.max_angle_deg = std::max(quality.max_angle_deg, *high * kDegrees);
        quality.mean_ratio_min = std::min(quality.mean_ratio_min, ratio);
        quality.mean_ratio_mean += ratio;
        quality.slivers += *low * kDegrees < 5.0;
        quality.degenerate += ratio == 0.0;
    }
    quality.mean_ratio_mean /= static_cast<double>(mesh.triangles.size());
    return quality;
}

}  // namespace sidewall::surface
