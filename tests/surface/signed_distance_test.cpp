#include "surface/distance.hpp"

#include <catch2/catch.hpp>

#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::surface;

namespace {

/// The box [-1, 1]^3 with outward normals.
TriangleMesh box() {
    TriangleMesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.vertices.emplace_back(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

}  // namespace

TEST_CASE(
    "distances are negative inside and exact beside faces, edges and corners, wherever the search begins") {
    const SignedDistance distance(box());
    // 61 scattered points in [-2, 2]^3.
    for (int n = 0; n < 61; ++n) {
        const Vec3 p(4.0 * (n * 17 % 61) / 60 - 2.0, 4.0 * (n * 23 % 61) / 60 - 2.0, 4.0 * n / 60 - 2.0);
        const Vec3 beyond = p.cwiseAbs() - Vec3::Ones();
        const double exact = beyond.maxCoeff() < 0.0 ? beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
        const DistanceSample sample = distance.at(p);
        CAPTURE(p.transpose());
        CHECK(sample.distance == Approx(exact).margin(1e-14));
        CHECK(sample.rise.norm() == Approx(1.0));
        // A step along the gradient changes the distance by the step's length.
        CHECK(distance.at(p + 1e-3 * sample.rise).distance == Approx(exact + 1e-3).margin(1e-12));
        for (const double radius : {0.0, 1e-3, std::abs(exact), 2.0})
            CHECK(distance.at(p, radius).distance == sample.distance);
    }
    const DistanceSample on = distance.at({0.3, 0.2, 1.0});
    CHECK(on.distance == Approx(0.0).margin(1e-15));
    CHECK(on.rise.isApprox(Vec3::UnitZ()));
}

TEST_CASE("an open surface tells above from below up to the sides that it ends on") {
    // A roof over [-1, 1]^2 whose ridge meets the sides y = +-1 at an angle.
    TriangleMesh mesh;
    const auto height = [](double x, double y) { return -std::abs(x - 0.3 * y); };
    for (const double y : {-1.0, 1.0})
        for (const double x : {-1.0, 0.3 * y, 1.0}) mesh.vertices.emplace_back(x, y, height(x, y));
    mesh.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
    const SignedDistance distance(mesh);
    for (const double x : {-1.0, -0.4, 0.0, 0.5, 1.0})
        for (const double y : {-1.0, -0.2, 0.7, 1.0})
            for (const double z : {-3.0, -1e-3, 1e-3, 3.0}) {
                CAPTURE(x, y, z);
                CHECK((distance.at({x, y, height(x, y) + z}).distance > 0.0) == (z > 0.0));
            }
}

TEST_CASE("coordinates beyond single precision are refused") {
    TriangleMesh mesh = box();
    for (Vec3& p : mesh.vertices) p *= 1e30;
    CHECK_THROWS_AS(SignedDistance(mesh).at(Vec3::Zero()), GeometryError);
}
