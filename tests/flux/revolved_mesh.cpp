#include "tests/flux/revolved_mesh.hpp"

#include <cmath>

namespace sidewall::flux {

TriangleMesh Revolved::sector(const Curve& curve, double longest) {
    TriangleMesh strip;
    const auto add = [&](double r, double z) {
        strip.vertices.emplace_back(r, -0.5 * kWidth, z);
        strip.vertices.emplace_back(r, 0.5 * kWidth, z);
        const auto end = static_cast<std::uint32_t>(strip.vertices.size());
        if (end < 4) return;
        const std::uint32_t a = end - 4, b = end - 2;
        strip.triangles.push_back({a, b, b + 1});
        strip.triangles.push_back({a, b + 1, a + 1});
    };
    add(curve[0][0], curve[0][1]);
    for (std::size_t k = 1; k < curve.size(); ++k) {
        const auto [r0, z0] = curve[k - 1];
        const auto [r1, z1] = curve[k];
        const int pieces =
            std::max(1, static_cast<int>(std::ceil(std::hypot(r1 - r0, z1 - z0) / longest - 1e-9)));
        for (int n = 1; n <= pieces; ++n) {
            const double t = static_cast<double>(n) / pieces;
            add(n == pieces ? r1 : r0 + t * (r1 - r0), n == pieces ? z1 : z0 + t * (z1 - z0));
        }
    }
    return sector_of(strip, curve.back()[0], kWidth);
}

}  // namespace sidewall::flux
