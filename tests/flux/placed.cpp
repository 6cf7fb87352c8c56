#include "tests/flux/placed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "surface/repair.hpp"
#include "tests/flux/flux_meshes.hpp"

namespace sidewall::flux {

Placed placed_mirrored(TriangleMesh mesh) {
    for (Vec3& p : mesh.vertices) p.x() = -p.x();
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return {"mirrored", std::move(mesh), [](const Vec3& p) { return Vec3(-p.x(), p.y(), p.z()); }};
}

Placed placed_turned(const TriangleMesh& mesh) {
    return {"turned by 90 degrees", turned(mesh), [](const Vec3& p) { return Vec3(p.y(), -p.x(), p.z()); }};
}

TriangleMesh wrapped(const TriangleMesh& mesh, int axis, double plane) {
    constexpr double kNear = 1e-7;
    const Box3 bounds = bounding_box(mesh);
    const double low = bounds.min[axis], high = bounds.max[axis], period = high - low;
    TriangleMesh result;
    std::vector<Vec3> points = mesh.vertices;
    for (Vec3& p : points)
        if (std::abs(p[axis] - plane) < kNear) p[axis] = plane;
    std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> cuts;  // by edge, the same for both triangles
    const auto cut = [&](std::uint32_t a, std::uint32_t b) {
        const auto edge = std::minmax(a, b);
        const auto [found, made] = cuts.try_emplace({edge.first, edge.second});
        if (made) {
            const Vec3 &p = points[edge.first], &q = points[edge.second];
            found->second = p + (plane - p[axis]) / (q[axis] - p[axis]) * (q - p);
            found->second[axis] = plane;
        }
        return found->second;
    };
    for (const Triangle& t : mesh.triangles)
        for (const double side : {-1.0, 1.0}) {
            std::vector<Vec3> polygon;
            bool beyond = false;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[(k + 1) % 3];
                const double at = side * (points[a][axis] - plane), to = side * (points[b][axis] - plane);
                beyond |= at > 0.0;
                if (at >= 0.0) polygon.push_back(points[a]);
                if (at * to < 0.0) polygon.push_back(cut(a, b));
            }
            if (!beyond) continue;
            const auto first = static_cast<std::uint32_t>(result.vertices.size());
            for (Vec3 p : polygon) {
                if (side < 0.0) p[axis] = p[axis] == low ? high : p[axis] + period;
                // Rounds away the last bits, in which opposite sides may differ.
                for (int k = 0; k < 3; ++k) p[k] = std::round(p[k] * 0x1p28) * 0x1p-28;
                result.vertices.push_back(p);
            }
            for (std::uint32_t k = 1; k + 1 < polygon.size(); ++k)
                result.triangles.push_back({first, first + k, first + k + 1});
        }
    surface::repair(result);  // welds equal vertices
    return result;
}

Placed placed_shifted(const TriangleMesh& mesh, double plane_x, double plane_y, const Vec3& centre) {
    const Vec3 size = bounding_box(mesh).size();
    return {"shifted", wrapped(wrapped(mesh, 0, plane_x), 1, plane_y), [size, centre](const Vec3& p) {
                return Vec3(centre.x() + std::remainder(p.x() - centre.x(), size.x()),
                            centre.y() + std::remainder(p.y() - centre.y(), size.y()), p.z());
            }};
}

}  // namespace sidewall::flux
