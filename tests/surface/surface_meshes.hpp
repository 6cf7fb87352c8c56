#pragma once
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "surface/triangle_mesh.hpp"

// Surfaces with known properties for the tests.
namespace sidewall::test {

/// A grid of nx x ny quadrilaterals, each split in two, mapped to space by \p place(u, v) with u, v in [0,
/// 1]. Normals point along du x dv. \p wrap_u and \p wrap_v join opposite ends.
inline TriangleMesh grid_mesh(std::uint32_t nx, std::uint32_t ny,
                              const std::function<Vec3(double, double)>& place, bool wrap_u = false,
                              bool wrap_v = false) {
    TriangleMesh mesh;
    const std::uint32_t columns = wrap_u ? nx : nx + 1, rows = wrap_v ? ny : ny + 1;
    for (std::uint32_t j = 0; j < rows; ++j)
        for (std::uint32_t i = 0; i < columns; ++i)
            mesh.vertices.push_back(place(double(i) / nx, double(j) / ny));
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return (j % rows) * columns + i % columns; };
    for (std::uint32_t j = 0; j < ny; ++j)
        for (std::uint32_t i = 0; i < nx; ++i) {
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return mesh;
}

/// All meshes in one.
inline TriangleMesh joined(const std::vector<TriangleMesh>& meshes) {
    TriangleMesh all;
    for (const TriangleMesh& mesh : meshes) {
        const auto first = static_cast<std::uint32_t>(all.vertices.size());
        all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
        for (const auto& [a, b, c] : mesh.triangles)
            all.triangles.push_back({first + a, first + b, first + c});
    }
    return all;
}

/// The mesh with three separate vertices for each triangle, as formats without shared vertices list it.
inline TriangleMesh soup(const TriangleMesh& mesh) {
    TriangleMesh loose;
    for (const Triangle& t : mesh.triangles) {
        const auto n = static_cast<std::uint32_t>(loose.vertices.size());
        for (const std::uint32_t v : t) loose.vertices.push_back(mesh.vertices[v]);
        loose.triangles.push_back({n, n + 1, n + 2});
    }
    return loose;
}

/// The plane z = 0 over [-1, 1]^2.
inline TriangleMesh plane_mesh(std::uint32_t n) {
    return grid_mesh(n, n, [](double u, double v) { return Vec3(2 * u - 1, 2 * v - 1, 0); });
}

/// Torus about the z axis.
inline TriangleMesh torus_mesh(std::uint32_t n, double major, double minor) {
    return grid_mesh(
        n, n,
        [=](double u, double v) {
            const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
            const double r = major + minor * std::cos(b);
            return Vec3(r * std::cos(a), r * std::sin(a), minor * std::sin(b));
        },
        true, true);
}

/// An icosahedron, each face split in four \p levels times, on the sphere of that radius.
inline TriangleMesh sphere_mesh(int levels, double radius) {
    const double g = std::numbers::phi;
    TriangleMesh mesh;
    mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [it, fresh] =
                middles.try_emplace(std::minmax(a, b), std::uint32_t(mesh.vertices.size()));
            if (fresh) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
            return it->second;
        };
        for (Vec3& p : mesh.vertices) p.normalize();
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    for (Vec3& p : mesh.vertices) p = radius * p.normalized();
    return mesh;
}

/// Moves every vertex by a random amount up to \p size in each coordinate.
inline void shake(TriangleMesh& mesh, double size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> shift(-size, size);
    for (Vec3& p : mesh.vertices) p += Vec3(shift(random), shift(random), shift(random));
}

}  // namespace sidewall::test
