#include "levelset/meshes/extract.hpp"

#include <tbb/global_control.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/marching_cubes.hpp"
#include "surface/quality.hpp"
#include "surface/topology.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

void check_surface(const TriangleMesh& mesh, long euler, std::size_t loops) {
    const auto topology = surface::analyse_topology(mesh);
    CHECK(topology.manifold());
    CHECK(topology.oriented());
    CHECK(topology.degenerate_triangles == 0);
    CHECK(topology.duplicate_triangles == 0);
    CHECK(topology.isolated_vertices == 0);
    CHECK(topology.euler() == euler);
    CHECK(topology.boundary_loops.size() == loops);
    if (loops > 0) CHECK(surface::boundary_on_rectangle(mesh, topology));
}

// Random values in [-1, 1] at every node of a box, so that every sign pattern occurs; its outermost nodes lie
// outside the material.
GridPtr noise_grid(const Domain& domain, unsigned seed) {
    const GridPtr grid = make_grid(domain);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> value(-1.0f, 1.0f);
    auto accessor = grid->getAccessor();
    const int n = domain.cells[0];
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j)
            for (int k = 0; k <= n; ++k) {
                const bool rim = i == 0 || j == 0 || k == 0 || i == n || j == n || k == n;
                accessor.setValueOn({i, j, k}, rim ? 0.5f : value(random));
            }
    return grid;
}

}  // namespace

TEST_CASE("extracted surfaces have the Euler number and the boundary of what they show") {
    const Domain domain = test::unit_domain(40);
    SECTION("sphere") {
        check_surface(extract_surface(*test::sphere_grid(domain, 12.3), domain), 2, 0);
    }
    SECTION("torus") {
        const auto torus = [](const Vec3& p) {
            return std::hypot(std::hypot(p.x(), p.y()) - 11.0, p.z()) - 4.5;
        };
        check_surface(extract_surface(*sample_grid(domain, torus, -6, 6), domain), 0, 0);
    }
    SECTION("plane on grid nodes") {
        check_surface(extract_surface(make_stack(domain, {{0, Shape{}}}).top(), domain), 1, 1);
    }
    Shape shape;
    shape.depth = 25.0;
    SECTION("trench") {
        shape.kind = ShapeKind::trench;
        shape.width = 14.0;
        check_surface(extract_surface(make_stack(domain, {{0, shape}}).top(), domain), 1, 1);
    }
    SECTION("hole") {
        shape.kind = ShapeKind::hole;
        shape.radius = 9.0;
        check_surface(extract_surface(make_stack(domain, {{0, shape}}).top(), domain), 1, 1);
    }
    SECTION("hole on periodic sides, cut by them") {
        const Domain periodic = test::unit_domain(40, Side::periodic);
        shape.kind = ShapeKind::hole;
        shape.radius = 9.0;
        shape.position = {20.0, 20.0};
        check_surface(extract_surface(make_stack(periodic, {{0, shape}}).top(), periodic), 1, 1);
    }
}

TEST_CASE("random fields give closed manifold surfaces without degenerate triangles") {
    const Domain domain = test::unit_domain(20);
    for (unsigned seed = 1; seed <= 10; ++seed) {
        const TriangleMesh mesh = extract_surface(*noise_grid(domain, seed), domain);
        const auto topology = surface::analyse_topology(mesh);
        CAPTURE(seed);
        CHECK(topology.closed());
        CHECK(topology.nonmanifold_edges == 0);
        CHECK(topology.nonmanifold_vertices == 0);
        CHECK(topology.oriented());
        CHECK(topology.degenerate_triangles == 0);
        CHECK(topology.duplicate_triangles == 0);
        CHECK(topology.isolated_vertices == 0);
    }
}

TEST_CASE("the table closes every cell: each pattern's edges run once in each direction or along a face") {
    const auto& table = surface::marching_cubes_table();
    CHECK(table[0].empty());
    CHECK(table[255].empty());
    for (std::size_t pattern = 1; pattern < 255; ++pattern) {
        // Exactly the cell edges whose ends differ in sign carry a vertex.
        unsigned used = 0, expected = 0;
        for (const auto e : table[pattern]) used |= 1u << e;
        for (int e = 0; e < 12; ++e) {
            const int a = surface::edge_corner(e), b = a + (1 << e / 4);
            if ((pattern >> a & 1) != (pattern >> b & 1)) expected |= 1u << e;
        }
        CHECK(used == expected);
    }
}

TEST_CASE("extraction gives the same bytes with 1 and 2 threads") {
    const Domain domain = test::unit_domain(60);
    const GridPtr grid = test::sphere_grid(domain, 25.7);
    TriangleMesh meshes[2];
    for (std::size_t threads : {1u, 2u}) {
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        meshes[threads - 1] = extract_surface(*grid, domain);
    }
    REQUIRE(meshes[0].vertices.size() == meshes[1].vertices.size());
    CHECK(std::memcmp(meshes[0].vertices.data(), meshes[1].vertices.data(),
                      meshes[0].vertices.size() * sizeof(Vec3)) == 0);
    CHECK(meshes[0].triangles == meshes[1].triangles);
}

TEST_CASE("the surface of a sphere lies on it to second order") {
    double error[2];
    for (int level = 0; level < 2; ++level) {
        const double radius = 10.0 * (1 + level);
        const Domain domain = test::unit_domain(static_cast<int>(2 * radius) + 10);
        error[level] =
            test::radius_error(extract_surface(*test::sphere_grid(domain, radius), domain), radius).max;
    }
    // Linear interpolation along an edge errs by at most dx^2 / (8 r); keeping clear of nodes adds 1e-3 dx.
    CHECK(error[0] < 1.0 / 80.0 + surface::kNodeClearance);
    CHECK(error[1] < 1.0 / 160.0 + surface::kNodeClearance);
}
