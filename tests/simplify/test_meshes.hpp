#pragma once
// Meshes as extracted from a level set: dense, uneven, cut by a grid, ending exactly on the sides of a box.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <unordered_map>

#include "surface/triangle_mesh.hpp"

namespace sidewall::test {

using Field = std::function<double(const Vec3&)>;

/// A grid whose nodes lie at min + spacing * (i, j, k), 0 <= i <= cells[0] and so on.
struct Grid {
    Vec3 min;
    double spacing = 1.0;
    std::array<int, 3> cells{};
};

/// Zero level of a field, negative inside, by marching tetrahedra (six a cell, Kuhn's): watertight, oriented.
inline TriangleMesh extract(const Grid& grid, const Field& field) {
    const auto [nx, ny, nz] = grid.cells;
    const auto node = [&](int i, int j, int k) { return (std::int64_t{k} * (ny + 1) + j) * (nx + 1) + i; };
    const auto position = [&](std::int64_t n) {
        const auto i = n % (nx + 1), j = n / (nx + 1) % (ny + 1), k = n / (nx + 1) / (ny + 1);
        return Vec3(grid.min + grid.spacing * Vec3(double(i), double(j), double(k)));
    };
    std::vector<double> phi(std::size_t(node(0, 0, nz + 1)));
    for (std::size_t n = 0; n < phi.size(); ++n) phi[n] = field(position(std::int64_t(n)));

    TriangleMesh mesh;
    std::unordered_map<std::int64_t, std::uint32_t> crossings;
    const auto crossing = [&](std::int64_t a, std::int64_t b) {
        if (a > b) std::swap(a, b);
        const auto [it, fresh] =
            crossings.try_emplace(a * std::int64_t(phi.size()) + b, std::uint32_t(mesh.vertices.size()));
        if (fresh) {
            const double fa = phi[std::size_t(a)], fb = phi[std::size_t(b)];
            const double t = std::clamp(fa / (fa - fb), 0.02, 0.98);
            const Vec3 p = position(a), q = position(b);
            mesh.vertices.push_back(p + t * (q - p));
        }
        return it->second;
    };
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, const Vec3& outward) {
        const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
        if ((q - p).cross(r - p).dot(outward) < 0.0) std::swap(b, c);
        mesh.triangles.push_back({a, b, c});
    };
    constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i)
                for (const auto& order : kOrders) {
                    std::array<int, 3> at{i, j, k};
                    std::array<std::int64_t, 4> tet{node(i, j, k)};
                    for (int s = 0; s < 3; ++s) {
                        ++at[std::size_t(order[s])];
                        tet[std::size_t(s) + 1] = node(at[0], at[1], at[2]);
                    }
                    std::vector<std::int64_t> in, out;
                    for (const auto n : tet) (phi[std::size_t(n)] < 0.0 ? in : out).push_back(n);
                    if (in.empty() || out.empty()) continue;
                    Vec3 outward = Vec3::Zero();
                    for (const auto n : out) outward += position(n) / double(out.size());
                    for (const auto n : in) outward -= position(n) / double(in.size());
                    if (in.size() == 2) {
                        const auto a = crossing(in[0], out[0]), b = crossing(in[0], out[1]),
                                   c = crossing(in[1], out[1]), d = crossing(in[1], out[0]);
                        add(a, b, c, outward);
                        add(a, c, d, outward);
                    } else {
                        const auto& many = in.size() == 1 ? out : in;
                        const auto one = in.size() == 1 ? in[0] : out[0];
                        add(crossing(one, many[0]), crossing(one, many[1]), crossing(one, many[2]), outward);
                    }
                }
    return mesh;
}

/// A pseudo-random value in [-1, 1] that depends only on the position.
inline double noise(const Vec3& p) {
    std::uint64_t h = 0x9e3779b97f4a7c15u;
    for (const double c : {p.x(), p.y(), p.z()}) {
        h ^= std::bit_cast<std::uint64_t>(c + 1000.0);
        h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
        h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
    }
    return double(h >> 11) * 0x1p-52 - 1.0;
}

/// Signed distance to the material x < 0, y < 0, whose corner is rounded by a radius.
inline double rounded_corner(double x, double y, double radius) {
    const double u = std::max(x + radius, 0.0), v = std::max(y + radius, 0.0);
    return std::min(std::max(x, y) + radius, 0.0) + std::hypot(u, v) - radius;
}

/// Material below z = 0 with a trench along y of the given width and depth, its corners rounded.
inline Field trench(double width, double depth, double radius) {
    return [=](const Vec3& p) {
        const double beyond_wall =
            0.5 * width - std::abs(p.x());  // negative in the material beside the trench
        const double bank = rounded_corner(beyond_wall, p.z(), radius);
        const double floor = p.z() + depth;
        // Smooth union of bank and floor with a fillet of the same radius.
        return -rounded_corner(-bank, -floor, radius);
    };
}

inline Field sphere(double radius) {
    return [=](const Vec3& p) { return p.norm() - radius; };
}

inline Field torus(double major, double minor) {
    return [=](const Vec3& p) { return std::hypot(std::hypot(p.x(), p.y()) - major, p.z()) - minor; };
}

inline Field rough(Field field, double amplitude) {
    return [=](const Vec3& p) { return field(p) + amplitude * noise(p); };
}

/// A trench about 4 wide and 8 deep, like that of the default recipe; no wall lies on grid nodes.
inline Field trench_field() {
    return trench(4.1, 8.05, 0.75);
}

/// Mesh of the trench in a box of 10 x length, with a noise of amplitude \p roughness in cells.
inline TriangleMesh trench_mesh(double spacing = 0.25, double roughness = 0.0, double length = 10.0) {
    const int n = int(std::lround(10.0 / spacing)), ny = int(std::lround(length / spacing)),
              nz = int(std::lround(10.0 / spacing));
    return extract({Vec3(-5.0, -0.5 * length, -9.0 - 0.37 * spacing), spacing, {n, ny, nz}},
                   rough(trench_field(), roughness * spacing));
}

inline TriangleMesh sphere_mesh(double radius, int cells) {
    const double half = 1.25 * radius;
    return extract({Vec3(-half, -half, -half), 2.0 * half / cells, {cells, cells, cells}}, sphere(radius));
}

inline TriangleMesh torus_mesh(double major, double minor, int cells) {
    const double half = 1.25 * (major + minor);
    return extract({Vec3(-half, -half, -half), 2.0 * half / cells, {cells, cells, cells}},
                   torus(major, minor));
}

/// Flat square of n x n cells, two triangles each, at z = 0.
inline TriangleMesh square_mesh(int n, double spacing) {
    TriangleMesh mesh;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) mesh.vertices.emplace_back(i * spacing, j * spacing, 0.0);
    const auto at = [n](int i, int j) { return std::uint32_t(j * (n + 1) + i); };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return mesh;
}

}  // namespace sidewall::test
