#include "surface/quality.hpp"

#include <catch2/catch.hpp>

#include "surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::surface;

TEST_CASE("mean ratio is 1 for an equilateral triangle of any size, 0 without area") {
    const Vec3 a(0, 0, 0), b(1e-6, 0, 0), c(0.5e-6, 0.5e-6 * std::numbers::sqrt3, 0);
    CHECK(mean_ratio(a, b, c) == Approx(1.0).epsilon(1e-14));
    CHECK(mean_ratio(a, b, 2 * b) == 0.0);
    CHECK(mean_ratio(a, a, a) == 0.0);
    // Right isosceles triangle: area 1/2, squared edges 1 + 1 + 2.
    CHECK(mean_ratio({0, 0, 0}, {1, 0, 0}, {0, 1, 0}) == Approx(std::numbers::sqrt3 / 2).epsilon(1e-14));
}

TEST_CASE("inner angles add up to pi, slivers included") {
    for (const double height : {1.0, 1e-3, 1e-9, 1e-14}) {
        const auto [a, b, c] = inner_angles({0, 0, 0}, {1, 0, 0}, {0.3, height, 0});
        CHECK(a + b + c == Approx(std::numbers::pi).epsilon(1e-15));
        CHECK(a == Approx(std::atan2(height, 0.3)).epsilon(1e-12));
    }
}

TEST_CASE("quality counts slivers under 5 degrees and triangles without area") {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0.03, 0}, {2, 0, 0}};
    mesh.triangles = {{0, 1, 2}};
    Quality quality = measure_quality(mesh);
    CHECK(quality.min_angle_deg == Approx(45.0).epsilon(1e-14));
    CHECK(quality.max_angle_deg == Approx(90.0).epsilon(1e-14));
    CHECK(quality.slivers == 0);
    mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 0, 2}};
    quality = measure_quality(mesh);
    CHECK(quality.min_angle_deg == 0.0);
    CHECK(quality.slivers == 3);
    CHECK(quality.degenerate == 2);
    CHECK(quality.mean_ratio_min == 0.0);
    CHECK(
        quality.mean_ratio_mean ==
        Approx((std::numbers::sqrt3 / 2 + mean_ratio(mesh.vertices[0], mesh.vertices[1], mesh.vertices[3])) /
               4));
    CHECK(measure_quality({}).mean_ratio_mean == 0.0);
}
