#include "tests/flux/flux_meshes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sidewall::flux {

TriangleMesh height_field(std::size_t nx, std::size_t ny, double x, double y,
                          const std::function<double(std::size_t, std::size_t)>& height) {
    TriangleMesh mesh;
    const auto index = [&](std::size_t i, std::size_t j) {
        return static_cast<std::uint32_t>(j * (nx + 1) + i);
    };
    for (std::size_t j = 0; j <= ny; ++j)
        for (std::size_t i = 0; i <= nx; ++i)
            mesh.vertices.emplace_back(x * static_cast<double>(i) / static_cast<double>(nx),
                                       y * static_cast<double>(j) / static_cast<double>(ny), height(i, j));
    for (std::size_t j = 0; j < ny; ++j)
        for (std::size_t i = 0; i < nx; ++i) {
            mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
            mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
        }
    return mesh;
}

TriangleMesh extrude(const Profile& profile, double length, std::size_t rows) {
    TriangleMesh mesh;
    const auto index = [&](std::size_t i, std::size_t j) {
        return static_cast<std::uint32_t>(i * (rows + 1) + j);
    };
    for (const auto& [x, z] : profile)
        for (std::size_t j = 0; j <= rows; ++j)
            mesh.vertices.emplace_back(x, length * static_cast<double>(j) / static_cast<double>(rows), z);
    for (std::size_t i = 0; i + 1 < profile.size(); ++i)
        for (std::size_t j = 0; j < rows; ++j) {
            mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
            mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
        }
    return mesh;
}

TriangleMesh turned(TriangleMesh mesh) {
    for (Vec3& p : mesh.vertices) p = Vec3(-p.y(), p.x(), p.z());
    return mesh;
}

Profile trench_profile(double depth, double ledge, const std::vector<double>& wall_cuts,
                       const std::vector<double>& floor_cuts) {
    Profile profile{{-0.5 - ledge, 0.0}, {-0.5, 0.0}};
    for (const double cut : wall_cuts) profile.emplace_back(-0.5, -depth * cut);
    profile.emplace_back(-0.5, -depth);
    for (const double cut : floor_cuts) profile.emplace_back(-0.5 + cut, -depth);
    profile.emplace_back(0.5, -depth);
    for (auto cut = wall_cuts.rbegin(); cut != wall_cuts.rend(); ++cut)
        profile.emplace_back(0.5, -depth * *cut);
    profile.emplace_back(0.5, 0.0);
    profile.emplace_back(0.5 + ledge, 0.0);
    return profile;
}

Hole round_hole(double radius, double depth, double half_side, std::size_t facets, double core) {
    Hole hole;
    const auto n = static_cast<std::uint32_t>(facets);
    const double angle = 2.0 * std::numbers::pi / static_cast<double>(n);
    const double equal_area = std::sqrt(angle / std::sin(angle));
    const auto ring = [&](double r, double z) {
        for (std::uint32_t i = 0; i < n; ++i)
            hole.mesh.vertices.emplace_back(r * equal_area * std::cos(i * angle),
                                            r * equal_area * std::sin(i * angle), z);
    };
    for (std::uint32_t i = 0; i < n; ++i) {  // where radii meet the square, exactly on its sides
        const double c = std::cos(i * angle), s = std::sin(i * angle);
        const bool on_x = std::abs(c) >= std::abs(s) - 1e-12, on_y = std::abs(s) >= std::abs(c) - 1e-12;
        const double scale = half_side / std::max(std::abs(c), std::abs(s));
        hole.mesh.vertices.emplace_back(on_x ? std::copysign(half_side, c) : scale * c,
                                        on_y ? std::copysign(half_side, s) : scale * s, 0.0);
    }
    ring(radius, 0.0);
    ring(radius, -depth);
    ring(core, -depth);
    hole.mesh.vertices.emplace_back(0.0, 0.0, -depth);
    for (const auto& [band, material] : {std::pair(0u, 0), std::pair(1u, 1), std::pair(2u, 3)})
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = band * n + i, b = band * n + (i + 1) % n;
            hole.mesh.triangles.push_back({a, b, b + n});
            hole.mesh.triangles.push_back({a, b + n, a + n});
            hole.materials.insert(hole.materials.end(), 2, material);
        }
    for (std::uint32_t i = 0; i < n; ++i) {
        hole.mesh.triangles.push_back({3 * n + i, 3 * n + (i + 1) % n, 4 * n});
        hole.materials.push_back(2);
    }
    return hole;
}

}  // namespace sidewall::flux
