#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "flux/tracer.hpp"

// Surfaces the flux tests build, each ending exactly on its rectangle, and how they trace and average.
namespace sidewall::flux {

inline constexpr std::array kReflective{Boundary::reflective, Boundary::reflective};
inline constexpr std::array kPeriodic{Boundary::periodic, Boundary::periodic};

using Profile = std::vector<std::pair<double, double>>;  // (x, z) from left to right, the material below

/// Two triangles a cell over [0, x] x [0, y] at z = height(x, y).
inline TriangleMesh height_field(std::size_t nx, std::size_t ny, double x, double y,
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

/// A profile extruded along y from 0 to \p length in \p rows. Segment s of the profile is the 2 \p rows
/// triangles from 2 rows s on.
inline TriangleMesh extrude(const Profile& profile, double length, std::size_t rows = 1) {
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

/// The mesh turned by 90 degrees about z, so that a trench along y lies along x.
inline TriangleMesh turned(TriangleMesh mesh) {
    for (Vec3& p : mesh.vertices) p = Vec3(-p.y(), p.x(), p.z());
    return mesh;
}

/// The trench of width 1 and the given depth between flat ledges, its walls and floor cut at the given
/// fractions (of depth, of width), ascending and without 0 and 1. Segment 0 is the left ledge, then left
/// wall, floor, right wall.
inline Profile trench_profile(double depth, double ledge, const std::vector<double>& wall_cuts,
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

/// A round hole of \p facets sides (a multiple of 8) whose polygon has the area of a circle of the given
/// radius, in a square plate. Materials: 0 plate, 1 wall, 2 floor within \p core, 3 the rest of the floor.
struct Hole {
    TriangleMesh mesh;
    std::vector<std::int32_t> materials;
};
inline Hole round_hole(double radius, double depth, double half_side, std::size_t facets, double core) {
    Hole hole;
    const auto n = static_cast<std::uint32_t>(facets);
    const double angle = 2.0 * std::numbers::pi / static_cast<double>(n);
    const double equal_area = std::sqrt(angle / std::sin(angle));
    const auto ring = [&](double r, double z) {
        for (std::uint32_t i = 0; i < n; ++i)
            hole.mesh.vertices.emplace_back(r * equal_area * std::cos(i * angle),
                                            r * equal_area * std::sin(i * angle), z);
    };
    for (std::uint32_t i = 0; i < n; ++i) {  // the square, met radially; exact on its sides
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

inline FluxResult trace(const TriangleMesh& mesh, std::array<Boundary, 2> boundary, const Species& species,
                        const TraceOptions& options, std::span<const std::int32_t> materials = {}) {
    const surface::RayScene scene(mesh);
    return trace_flux(mesh, scene, lateral_box(mesh, boundary), species, materials,
                      make_wedges(mesh, materials), options);
}

/// Mean flux over some triangles and its standard error, their counts taken as independent.
struct Mean {
    double flux = 0.0, error = 0.0;
};
inline Mean mean_flux(const TriangleMesh& mesh, const FluxResult& result,
                      const std::function<bool(std::size_t)>& chosen) {
    double area = 0.0, sum = 0.0, variance = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!chosen(t)) continue;
        const double a = triangle_area(mesh, t);
        area += a;
        sum += a * result.triangle.flux[t];
        variance += a * a * result.triangle.error[t] * result.triangle.error[t];
    }
    return {sum / area, std::sqrt(variance) / area};
}

}  // namespace sidewall::flux
