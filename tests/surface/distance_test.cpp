#include "surface/distance.hpp"

#include <tbb/global_control.h>

#include <catch2/catch.hpp>

#include "surface/error.hpp"
#include "surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::surface;

TEST_CASE("parallel planes are as far apart as their offset, everywhere") {
    const TriangleMesh floor = test::plane_mesh(9);
    TriangleMesh roof = test::plane_mesh(16);
    for (Vec3& p : roof.vertices) p.z() = 0.375;
    const TwoSidedDistance d = two_sided_distance(floor, roof);
    CHECK(d.max == 0.375);
    CHECK(d.mean == 0.375);
    CHECK(d.forward.per_vertex == std::vector<double>(100, 0.375));
    CHECK(d.backward.per_vertex.size() == 17 * 17);
}

TEST_CASE("a surface lies on itself and on its own refinement") {
    const TriangleMesh torus = test::torus_mesh(40, 1.0, 0.4);
    CHECK(two_sided_distance(torus, torus).max <= 1e-15);
    // A refined plane is the same set of points.
    CHECK(two_sided_distance(test::plane_mesh(5), test::plane_mesh(35)).max <= 1e-15);
}

TEST_CASE("distance to a sphere is the difference of the radii within its chord error") {
    const TriangleMesh sphere = test::sphere_mesh(4, 1.0);
    // Icosahedron edges of 1.05, halved four times, are at most h = 1.2 / 16 long. Facets have circumradii up
    // to h / sqrt 3 and so lie at most (h^2 / 3) / 2 below the sphere.
    const double edge = 1.2 / 16.0, chord = edge * edge / 6.0;
    const TriangleMesh outside = test::sphere_mesh(2, 1.5), inside = test::sphere_mesh(2, 0.5);
    for (const double d : distance(outside, sphere).per_vertex) CHECK((d >= 0.5 - 1e-12 && d <= 0.5 + chord));
    for (const double d : distance(inside, sphere).per_vertex) CHECK((d <= 0.5 + 1e-12 && d >= 0.5 - chord));
}

TEST_CASE("the hierarchy finds what looking at every triangle finds") {
    TriangleMesh a = test::torus_mesh(14, 1.0, 0.3), b = test::sphere_mesh(2, 1.1);
    test::shake(a, 0.2, 5);
    test::shake(b, 0.2, 6);
    // Shuffled vertices: the search radius, taken from the distance to the vertex before, jumps.
    std::shuffle(a.vertices.begin(), a.vertices.end(), std::mt19937(7));
    const Distance found = distance(a, b);
    double sum = 0.0;
    for (std::size_t i = 0; i < a.vertices.size(); ++i) {
        double best = 1e300;
        for (const auto& [p, q, r] : b.triangles)
            best = std::min(
                best, closest_point_on_triangle(a.vertices[i], b.vertices[p], b.vertices[q], b.vertices[r])
                          .distance);
        REQUIRE(found.per_vertex[i] == best);
        sum += best;
    }
    CHECK(found.mean == sum / double(a.vertices.size()));
}

TEST_CASE("distances have the same bits on one and on two threads") {
    TriangleMesh a = test::sphere_mesh(5, 1.0);
    test::shake(a, 0.01, 8);
    const TriangleMesh b = test::sphere_mesh(4, 1.0);
    const auto measure = [&](std::size_t threads) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        return distance(a, b);
    };
    const Distance one = measure(1), two = measure(2);
    CHECK(one.per_vertex == two.per_vertex);
    CHECK(one.mean == two.mean);
}

TEST_CASE("a vertex that no triangle uses has no distance") {
    TriangleMesh from;
    from.vertices = {{9.0, 9.0, 9.0}, {0.0, 0.0, 1.0}, {1.0, 0.0, 1.0}, {0.0, 1.0, 1.0}};
    from.triangles = {{1, 2, 3}};
    TriangleMesh to = from;
    for (Vec3& p : to.vertices) p.z() = 0.0;
    const auto result = surface::distance(from, to);
    CHECK(result.max == Approx(1.0));
    CHECK(result.mean == Approx(1.0));
    CHECK(result.per_vertex[0] == 0.0);
    from.triangles.clear();
    CHECK(surface::distance(from, to).max > 10.0);
}

TEST_CASE("an empty mesh has no distance") {
    CHECK_THROWS_AS(distance({}, test::plane_mesh(1)), GeometryError);
    CHECK_THROWS_AS(distance(test::plane_mesh(1), TriangleMesh{}), GeometryError);
}
