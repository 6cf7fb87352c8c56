#include <catch2/catch.hpp>
#include <cmath>

#include "flux/tracer/cut_corners.hpp"
#include "flux/yield.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"

// Yields where a mesh cuts off a hollow corner.
using namespace sidewall;
using namespace sidewall::flux;

namespace {

constexpr double kSpacing = 0.1;
// Straight down, all but parallel; at 45 degrees it sputters 4 times what it does at 0.
Species beam() {
    Species ion{"ion", 1e6, {1.0}};
    ion.yields = {{"sputter", Angular::sputter, 0.0, {1.0}, {9.3}}};
    return ion;
}

double own_yield(double angle) {
    return angular_factor(beam().yields[0], std::cos(angle * kDegree));
}

// Sputtered per arrival on segment \p s of an extruded profile.
double yield_on(const TriangleMesh& mesh, const FluxResult& result, std::size_t s) {
    const auto on = [s](std::size_t t) { return t / 2 == s; };
    double arrived = 0.0, sputtered = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!on(t)) continue;
        arrived += triangle_area(mesh, t) * result.triangle.flux[t];
        sputtered += triangle_area(mesh, t) * result.others[0].triangle.flux[t];
    }
    REQUIRE(arrived > 0.0);
    return sputtered / arrived;
}

FluxResult traced(const TriangleMesh& mesh, double spacing) {
    return trace(mesh, kPeriodic, beam(), {.rays = 20000, .grid_spacing = spacing});
}

// One row of cells.
TriangleMesh row(const Profile& profile) {
    return extrude(profile, 0.1);
}

void check_unchanged(const TriangleMesh& mesh) {
    CHECK(traced(mesh, kSpacing).others[0].triangle.flux == traced(mesh, 0.0).others[0].triangle.flux);
}

}  // namespace

TEST_CASE("a facet that cuts off the corner of a wall and a floor yields what the floor does") {
    const TriangleMesh mesh =
        row({{0.0, 1.0}, {1.0, 1.0}, {1.0, 0.1}, {1.1, 0.0}, {1.9, 0.0}, {2.0, 0.1}, {2.0, 1.0}, {3.0, 1.0}});
    const FluxResult as_is = traced(mesh, 0.0), mended = traced(mesh, kSpacing);
    CHECK(mended.triangle.flux == as_is.triangle.flux);
    for (const std::size_t facet : {2u, 4u}) {
        // The yield of 45 degrees, of directions that scatter by 1e-3.
        CHECK(yield_on(mesh, as_is, facet) == Approx(own_yield(45.0)).epsilon(1e-3));
        CHECK(yield_on(mesh, mended, facet) == Approx(1.0).epsilon(1e-3));
    }
    for (const std::size_t flat : {0u, 3u, 6u})
        CHECK(yield_on(mesh, mended, flat) == yield_on(mesh, as_is, flat));
}

TEST_CASE("where a slope meets a wall, the corner moves as a floor would that opens between them") {
    const double rise = 0.8 * std::tan(20.0 * kDegree);
    const TriangleMesh mesh =
        row({{0.0, 1.0}, {1.0, 1.0}, {1.0, 0.1}, {1.1, 0.0}, {1.9, rise}, {2.0, 1.0}, {3.0, 1.0}});
    CHECK(own_yield(20.0) > 1.5);
    CHECK(yield_on(mesh, traced(mesh, kSpacing), 2) == Approx(1.0).epsilon(1e-3));
    CHECK(yield_on(mesh, traced(mesh, kSpacing), 3) == Approx(own_yield(20.0)).epsilon(1e-3));
}

TEST_CASE("the floor of a narrow groove keeps its own yield, which is less than its sides'") {
    const double height = 0.9 * std::tan(30.0 * kDegree);
    const TriangleMesh mesh = row({{0.0, height}, {0.9, 0.0}, {1.0, 0.0}, {1.9, height}, {2.0, height}});
    CHECK(yield_on(mesh, traced(mesh, kSpacing), 1) == Approx(1.0).epsilon(1e-3));
}

TEST_CASE(
    "chamfers wider than a facet of the grid, edges that stand out and gentle curves yield as they are") {
    check_unchanged(row(
        {{0.0, 1.0}, {1.0, 1.0}, {1.0, 0.3}, {1.3, 0.0}, {1.7, 0.0}, {2.0, 0.3}, {2.0, 1.0}, {3.0, 1.0}}));
    check_unchanged(row(
        {{0.0, 0.0}, {1.0, 0.0}, {1.0, 0.9}, {1.1, 1.0}, {1.9, 1.0}, {2.0, 0.9}, {2.0, 0.0}, {3.0, 0.0}}));
    // A quarter of a circle of 10 cells, in facets of one cell, between a wall and a floor.
    Profile round{{0.0, 2.0}, {1.0, 2.0}};
    for (int i = 0; i <= 16; ++i) {
        const double angle = i / 16.0 * 90.0 * kDegree;
        round.emplace_back(2.0 - std::cos(angle), 1.0 - std::sin(angle));
    }
    round.insert(round.end(), {{2.5, 0.0}, {2.6, 2.0}, {3.0, 2.0}});
    check_unchanged(row(round));
}

TEST_CASE("cut corners: the two faces make up the facet, and without a grid there are none") {
    const TriangleMesh mesh =
        row({{0.0, 1.0}, {1.0, 1.0}, {1.0, 0.05}, {1.1, 0.0}, {2.0, 0.0}, {2.0, 1.0}, {3.0, 1.0}});
    const CutCorners cut = find_cut_corners(mesh, kSpacing);
    const std::vector<Vec3> normals = triangle_normals(mesh);
    for (std::uint32_t t = 4; t < 6; ++t) {
        const CutCorner* corner = cut.at(t);
        REQUIRE(corner != nullptr);
        CHECK((corner->share[0] * corner->normal[0] + corner->share[1] * corner->normal[1] - normals[t])
                  .norm() < 1e-12);
        // Areas of wall and floor that a unit of the facet stands for.
        CHECK(corner->share[0] + corner->share[1] == Approx(0.15 / std::hypot(0.1, 0.05)));
    }
    CHECK(find_cut_corners(mesh, 0.0).at(4) == nullptr);
}
