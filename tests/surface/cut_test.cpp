#include "surface/cut.hpp"

#include <catch2/catch.hpp>
#include <fstream>

#include "surface/error.hpp"
#include "surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::surface;

namespace {

double length(const Polyline& line) {
    double sum = line.closed ? (line.points.back() - line.points.front()).norm() : 0.0;
    for (std::size_t i = 1; i < line.points.size(); ++i) sum += (line.points[i] - line.points[i - 1]).norm();
    return sum;
}

/// Area enclosed by the line, seen against the plane's normal; positive if it lies to the left.
double signed_area(const Polyline& line, const Plane& plane) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < line.points.size(); ++i)
        sum += line.points[i].cross(line.points[(i + 1) % line.points.size()]);
    return 0.5 * sum.dot(plane.normal.normalized());
}

}  // namespace

TEST_CASE("a sphere is cut in one circle around its material") {
    const TriangleMesh sphere = test::sphere_mesh(4, 1.0);
    // Planes through vertices (some lie exactly at x = 0), between vertices, and tilted.
    const Plane plane = GENERATE(Plane{Vec3::UnitX(), 0.0}, Plane{Vec3::UnitY(), 0.1},
                                 Plane{-Vec3::UnitZ(), 0.2}, Plane{Vec3(1, 2, -3), 0.5});
    const auto lines = cut_by_plane(sphere, plane);
    REQUIRE(lines.size() == 1);
    CHECK(lines[0].closed);
    CHECK(lines[0].triangles.size() == lines[0].points.size());
    const double at = plane.offset / plane.normal.norm(), radius = std::sqrt(1.0 - at * at);
    const double edge = 1.2 / 16.0;
    for (const Vec3& p : lines[0].points) {
        CHECK(std::abs(plane.normal.dot(p) - plane.offset) <= 1e-14);
        CHECK(std::abs(p.norm() - 1.0) <= edge * edge / 6.0);
    }
    CHECK(length(lines[0]) == Approx(2 * std::numbers::pi * radius).epsilon(edge * edge));
    // The material lies to the left, so that the area is positive.
    CHECK(signed_area(lines[0], plane) == Approx(std::numbers::pi * radius * radius).epsilon(edge * edge));
}

TEST_CASE("a torus is cut in two circles, across and along") {
    const TriangleMesh torus = test::torus_mesh(48, 1.0, 0.25);
    CHECK(cut_by_plane(torus, {Vec3::UnitY(), 0.0}).size() == 2);
    const auto flat = cut_by_plane(torus, {Vec3::UnitZ(), 0.0});
    REQUIRE(flat.size() == 2);
    // The outer circle has the material inside, the inner one has it outside.
    CHECK(signed_area(flat[0], {Vec3::UnitZ(), 0.0}) * signed_area(flat[1], {Vec3::UnitZ(), 0.0}) < 0.0);
    CHECK(cut_by_plane(torus, {Vec3::UnitZ(), 0.5}).empty());
}

TEST_CASE("a closed surface is cut in closed lines alone, however its vertices lie on the plane") {
    // Vertices snapped to a coarse lattice put many of them, and whole triangles, on the plane.
    TriangleMesh mesh = test::torus_mesh(24, 1.0, 0.45);
    for (Vec3& p : mesh.vertices) p = (p * 4.0).array().round() / 4.0;
    for (const double offset : {-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.25})
        for (const Vec3& normal : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 1, 0)}) {
            for (const Polyline& line : cut_by_plane(mesh, {normal, offset})) {
                REQUIRE(line.closed);
                for (const Vec3& p : line.points) REQUIRE(normal.dot(p) == Approx(offset).margin(1e-14));
            }
        }
}

TEST_CASE("a surface over a rectangle is cut in one open line from side to side, material below it") {
    const auto profile = [](double x) { return std::sin(3.0 * x); };
    TriangleMesh mesh = test::plane_mesh(20);
    for (Vec3& p : mesh.vertices) p.z() = profile(p.x());
    // y = 0 runs along mesh edges, 0.03 between them, -1 + 1e-9 next to a side, -1 and 1 on the sides.
    const double y = GENERATE(0.0, 0.03, -1.0 + 1e-9, -1.0, 1.0);
    const Plane plane{Vec3::UnitY(), y};
    const auto lines = cut_by_plane(mesh, plane);
    REQUIRE(lines.size() == 1);
    CHECK_FALSE(lines[0].closed);
    REQUIRE(lines[0].triangles.size() == lines[0].points.size() - 1);
    const double first = lines[0].points.front().x(), last = lines[0].points.back().x();
    CHECK(std::abs(first) == 1.0);
    CHECK(first == -last);
    // Seen against the normal +y, the x axis points left. The line has the material below it to its left, so
    // it runs towards +x.
    CHECK(first < last);
    for (const Vec3& p : lines[0].points) {
        CHECK(p.y() == y);
        CHECK(std::abs(p.z() - profile(p.x())) <= 0.1 * 0.1 / 8.0 * 9.0 + 1e-12);
    }
}

TEST_CASE("a plane that only touches the surface cuts nothing") {
    const TriangleMesh floor = test::plane_mesh(3);
    CHECK(cut_by_plane(floor, {Vec3::UnitZ(), 0.0}).empty());
    CHECK(cut_by_plane(floor, {Vec3::UnitX(), -1.01}).empty());
    CHECK(cut_by_plane(test::torus_mesh(24, 1.0, 0.5), {Vec3::UnitX(), -1.5}).empty());
    CHECK(cut_by_plane({}, {}).empty());
    CHECK_THROWS_AS(cut_by_plane(floor, {Vec3::Zero(), 0.0}), GeometryError);
    CHECK_THROWS_AS(cut_by_plane(floor, {Vec3::UnitX(), std::nan("")}), GeometryError);
}

TEST_CASE("a profile is a CSV of in-plane coordinates, closed lines ending where they began") {
    Polyline open{{{1, 0, 2}, {0.1, 0, -3}}, {0}, false},
        closed{{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {0, 1, 2}, true};
    CHECK(profile_csv({open, closed}, {Vec3::UnitY(), 0.0}) ==
          "x,z,polyline\n1,2,0\n0.1,-3,0\n0,0,1\n1,0,1\n0,1,1\n0,0,1\n");
    CHECK(profile_csv({}, {Vec3::UnitX(), 0.0}) == "y,z,polyline\n");
    CHECK(profile_csv({}, {Vec3::UnitZ(), 0.0}) == "x,y,polyline\n");
    CHECK(profile_csv({}, {Vec3(1, 1, 0), 0.0}) == "a,b,polyline\n");
    const auto [a, b] = plane_axes({Vec3(3, -1, 0.5), 0.0});
    CHECK(a.z() == 0.0);
    CHECK(b.z() > 0.0);
    CHECK(std::abs(a.dot(b)) <= 1e-15);
}

TEST_CASE("a plane is written as axis=number") {
    CHECK(parse_plane("y=0").normal == Vec3::UnitY());
    CHECK(parse_plane("x=-1.5").offset == -1.5);
    for (const char* bad : {"", "y", "y=", "w=1", "y=1.5um", "y==1", "y=nan", "y=inf", "=1", "Y=1"}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(parse_plane(bad), RecipeError);
    }
}
