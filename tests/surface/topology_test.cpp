#include "surface/topology.hpp"

#include <catch2/catch.hpp>

#include "surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::surface;

TEST_CASE("Euler's number is 2 on a sphere, 0 on a torus, 1 on a disk, and adds up over components") {
    const Topology sphere = analyse_topology(test::sphere_mesh(3, 1.0));
    CHECK(sphere.euler() == 2);
    CHECK(sphere.closed());
    CHECK(sphere.manifold());
    CHECK(sphere.oriented());
    CHECK(sphere.components == 1);
    CHECK(sphere.edges == 3 * sphere.triangles / 2);

    const Topology torus = analyse_topology(test::torus_mesh(12, 1.0, 0.3));
    CHECK(torus.euler() == 0);
    CHECK(torus.closed());

    const Topology plane = analyse_topology(test::plane_mesh(7));
    CHECK(plane.euler() == 1);
    CHECK(plane.boundary_edges == 4 * 7);
    CHECK(plane.boundary_loops.items.size() == 4 * 7);

    const Topology both =
        analyse_topology(test::joined({test::sphere_mesh(1, 1.0), test::torus_mesh(5, 3.0, 1.0)}));
    CHECK(both.euler() == 2);
    CHECK(both.components == 2);
}

TEST_CASE("boundary loops visit every boundary vertex once with the surface to the left") {
    // An annulus has two boundary loops that run in opposite senses.
    const TriangleMesh ring = test::grid_mesh(
        16, 3,
        [](double u, double v) {
            const double a = -2 * std::numbers::pi * u;
            return Vec3((1 + v) * std::cos(a), (1 + v) * std::sin(a), 0.0);
        },
        true, false);
    const Topology topology = analyse_topology(ring);
    CHECK(topology.euler() == 0);
    REQUIRE(topology.boundary_loops.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
        const auto loop = topology.boundary_loops[i];
        REQUIRE(loop.size() == 16);
        const Vec3 a = ring.vertices[loop[0]], b = ring.vertices[loop[1]];
        const double sense = a.cross(b).z();
        CHECK((a.norm() > 1.5 ? sense > 0.0 : sense < 0.0));
    }
}

TEST_CASE(
    "faults are counted: shared edges, pinched vertices, flips, duplicates, zero areas, loose vertices") {
    TriangleMesh mesh = test::plane_mesh(4);
    const Topology clean = analyse_topology(mesh);
    CHECK(clean.manifold());
    CHECK(clean.oriented());

    SECTION("a third triangle on an edge") {
        mesh.vertices.emplace_back(0, 0, 1);
        mesh.triangles.push_back(
            {mesh.triangles[9][0], mesh.triangles[9][1], std::uint32_t(mesh.vertices.size() - 1)});
        CHECK(analyse_topology(mesh).nonmanifold_edges == 1);
    }
    SECTION("two sheets that touch in a vertex") {
        const auto n = std::uint32_t(mesh.vertices.size());
        mesh.vertices.emplace_back(0, 0, 1);
        mesh.vertices.emplace_back(1, 0, 1);
        mesh.triangles.push_back({12, n, n + 1});
        const Topology topology = analyse_topology(mesh);
        CHECK(topology.nonmanifold_vertices == 1);
        CHECK(topology.nonmanifold_edges == 0);
        CHECK(topology.components == 1);
    }
    SECTION("a flipped triangle disagrees with its three neighbours") {
        std::swap(mesh.triangles[10][0], mesh.triangles[10][1]);
        CHECK(analyse_topology(mesh).inconsistent_edges == 3);
    }
    SECTION("duplicates in any order of vertices") {
        const auto [a, b, c] = mesh.triangles[0];
        mesh.triangles.push_back({c, a, b});
        mesh.triangles.push_back({b, a, c});
        CHECK(analyse_topology(mesh).duplicate_triangles == 2);
    }
    SECTION("repeated vertices and collinear ones have no area") {
        mesh.triangles.push_back({0, 0, 1});
        mesh.triangles.push_back({0, 1, 2});
        CHECK(analyse_topology(mesh).degenerate_triangles == 2);
    }
    SECTION("a vertex of no triangle") {
        mesh.vertices.emplace_back(9, 9, 9);
        const Topology topology = analyse_topology(mesh);
        CHECK(topology.isolated_vertices == 1);
        CHECK(topology.euler() == 1);
    }
}

TEST_CASE("an empty mesh has an empty topology") {
    const Topology topology = analyse_topology({});
    CHECK(topology.components == 0);
    CHECK(topology.euler() == 0);
    CHECK(edge_table({}).corners.size() == 0);
}

TEST_CASE("only a boundary wholly in the four side planes lies on a rectangle") {
    TriangleMesh mesh = test::plane_mesh(6);
    CHECK(boundary_on_rectangle(mesh, analyse_topology(mesh)));
    SECTION("relief does not matter") {
        for (Vec3& p : mesh.vertices) p.z() = std::sin(3 * p.x()) * p.y();
        CHECK(boundary_on_rectangle(mesh, analyse_topology(mesh)));
    }
    SECTION("a vertex one bit off a side does") {
        mesh.vertices[3].y() = std::nextafter(mesh.vertices[3].y(), 0.0);
        CHECK_FALSE(boundary_on_rectangle(mesh, analyse_topology(mesh)));
    }
    SECTION("a hole inside does") {
        mesh.triangles.erase(mesh.triangles.begin() + 20);
        CHECK_FALSE(boundary_on_rectangle(mesh, analyse_topology(mesh)));
    }
    const TriangleMesh sphere = test::sphere_mesh(1, 1.0);
    CHECK_FALSE(boundary_on_rectangle(sphere, analyse_topology(sphere)));
}

TEST_CASE("the edge table lists each edge once, sorted, with its one or two corners") {
    const TriangleMesh mesh = test::plane_mesh(5);
    const EdgeTable table = edge_table(mesh);
    REQUIRE(table.corners.size() == table.edges.size());
    CHECK(std::is_sorted(table.edges.begin(), table.edges.end()));
    CHECK(std::adjacent_find(table.edges.begin(), table.edges.end()) == table.edges.end());
    std::size_t boundary = 0;
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        for (const std::uint32_t c : table.corners[e]) {
            const Triangle& t = mesh.triangles[c / 3];
            const std::uint32_t a = t[c % 3], b = t[(c % 3 + 1) % 3];
            REQUIRE(std::min(a, b) == table.edges[e][0]);
            REQUIRE(std::max(a, b) == table.edges[e][1]);
        }
        boundary += table.corners[e].size() == 1;
    }
    CHECK(boundary == 20);
}
