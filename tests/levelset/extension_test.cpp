#include "levelset/motion/speed_extension.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "levelset/motion/sample_index.hpp"
#include "levelset/openvdb_grid.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

// World position of a grid node, of any type of integer coordinates.
template <class Node>
Vec3 world(const Domain& domain, const Node& c) {
    return {domain.coordinate(0, c.x()), domain.coordinate(1, c.y()), domain.coordinate(2, c.z())};
}

Vec3 point_of(const TriangleMesh& mesh, const SurfaceSample& s) {
    const auto [a, b, c] = mesh.triangles[s.triangle];
    const double u = s.u, v = s.v;
    return (1.0 - u - v) * mesh.vertices[a] + u * mesh.vertices[b] + v * mesh.vertices[c];
}

// Largest excess of a node's distance to its sample: `near` over that to the nearest surface point, for nodes
// that have samples; `band` over |phi|, for all nodes of the band.
struct Excess {
    double near = 0.0, band = 0.0;
};

Excess excess(const Grid& grid, const Domain& domain, const TriangleMesh& mesh) {
    const surface::RayScene scene(mesh);
    const Extension extension = extend(grid, domain, scene);
    Excess most;
    for (const SurfaceSample& s : extension.samples) {
        const Vec3 node = world(domain, s.node);
        const double nearest = scene.closest_point(node, 1e30).distance;
        most.near = std::max(most.near, (point_of(mesh, s) - node).norm() - nearest);
    }
    for (auto it = grid.cbeginValueOn(); it; ++it) {
        const std::int32_t k = extension.sample_of->at(it.getCoord());
        REQUIRE(k >= 0);
        const double d =
            (point_of(mesh, extension.samples[static_cast<std::size_t>(k)]) - world(domain, it.getCoord()))
                .norm();
        most.band = std::max(most.band, d - std::abs(static_cast<double>(*it)));
    }
    return most;
}

}  // namespace

TEST_CASE("every node of the band takes its speed next to its foot point on a sphere") {
    const Domain domain = test::unit_domain(40);
    const GridPtr grid = test::sphere_grid(domain, 12.3);
    const TriangleMesh mesh = extract_surface(*grid, domain);
    const Excess e = excess(*grid, domain, mesh);
    // Foot points are sought along the gradient, from up to 0.9 dx away. Facets are tilted against it by up
    // to sqrt(3)/2 dx / r, which adds 0.9 dx (1 / cos - 1).
    const double tilt = 0.5 * std::sqrt(3.0) / 12.3;
    CHECK(e.near < 0.9 * (1.0 / std::cos(tilt) - 1.0));
    // A far node takes the sample of the node beside its foot point: at most sqrt(3)/2 dx to the side.
    CHECK(e.band < 0.9);
}

TEST_CASE("every node of the band takes its speed next to its foot point in a trench") {
    const Domain domain = test::unit_domain(40);
    Shape trench;
    trench.kind = ShapeKind::trench;
    trench.width = 15.3;
    trench.depth = 20.4;
    const MaterialStack stack = make_stack(domain, {{0, trench}});
    const TriangleMesh mesh = extract_surface(stack.top(), domain);
    const Excess e = excess(stack.top(), domain, mesh);
    // At an edge the gradient points between the faces: its foot point is up to (1 - 1/sqrt(2)) of a cell
    // farther away than the nearest point.
    CHECK(e.near < 0.3);
    CHECK(e.band < 1.5);
}

TEST_CASE("triangles much larger than a cell serve all nodes above them") {
    const Domain domain = test::unit_domain(40);
    const double height = 0.37;
    const GridPtr grid = sample_grid(
        domain, [=](const Vec3& p) { return p.z() - height; }, -6, 6);
    TriangleMesh mesh;
    for (const auto& [x, y] : {std::pair{-20.0, -20.0}, {20.0, -20.0}, {20.0, 20.0}, {-20.0, 20.0}})
        mesh.vertices.push_back(Vec3(x, y, height));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    const surface::RayScene scene(mesh);
    const Extension extension = extend(*grid, domain, scene);
    double away = 0.0;
    for (const SurfaceSample& s : extension.samples) {
        const Vec3 node = world(domain, s.node);
        away = std::max(away, (point_of(mesh, s) - Vec3(node.x(), node.y(), height)).norm());
    }
    // Barycentric weights are single precision, over triangles of 40 dx.
    CHECK(away < 40.0 * 1e-6);
}

TEST_CASE("a mesh far from the level set still serves every node") {
    const Domain domain = test::unit_domain(20);
    const GridPtr grid = sample_grid(
        domain, [](const Vec3& p) { return p.z(); }, -6, 6);
    TriangleMesh mesh;
    mesh.vertices = {Vec3(-10, -10, 30), Vec3(10, -10, 30), Vec3(0, 10, 30)};
    mesh.triangles = {{0, 1, 2}};
    CHECK(excess(*grid, domain, mesh).near < 1e-4);
}
