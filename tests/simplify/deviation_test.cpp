#include "simplify/deviation.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

using namespace sidewall;
using namespace sidewall::simplify;

TEST_CASE("of two witnesses the one farther from the triangles around is kept") {
    // A flat hexagon of side 1. Its middle vertex moves to the origin.
    TriangleMesh hexagon;
    hexagon.vertices.emplace_back(0.4, 0.0, 0.2);
    std::vector<MovedTriangle> moved;
    for (std::uint32_t k = 0; k < 6; ++k) {
        const double angle = k * std::acos(0.5);
        hexagon.vertices.emplace_back(std::cos(angle), std::sin(angle), 0.0);
        hexagon.triangles.push_back({0, k + 1, (k + 1) % 6 + 1});
        moved.push_back({k, k + 1, (k + 1) % 6 + 1});
    }
    const CollapseMesh mesh(hexagon);
    const Vec3 above(0.1, 0.2, 0.3), below(-0.2, 0.1, -0.5), beside(2.0, 0.0, 0.0);
    const auto farther = [&](const Vec3& a, const Vec3& b, double enough2) {
        const double scale2 = mesh.scale * mesh.scale;
        Witness witness = farther_witness(mesh, mesh.to_mesh(Vec3::Zero()), moved, mesh.to_mesh(a),
                                          mesh.to_mesh(b), enough2 * scale2);
        return Witness{mesh.to_world(witness.point), witness.distance2 / scale2};
    };
    for (const auto& [a, b] : {std::pair{above, below}, {below, above}}) {
        const Witness witness = farther(a, b, 0.0);
        CHECK(witness.point.isApprox(below));
        CHECK(witness.distance2 == Approx(0.25));
    }
    CHECK(farther(below, beside, 0.0).distance2 == Approx(1.0));
    CHECK(farther(above, below, 0.16).point.isApprox(below));  // 0.09 < 0.16: the search for above ends early
}

TEST_CASE("the limit of outliers follows the recent distances, once there are enough") {
    RecentDistances distances;
    for (int k = 0; k < 199; ++k) distances.add(4.0);
    CHECK(distances.limit2() == std::numeric_limits<double>::infinity());
    distances.add(4.0);
    CHECK(distances.limit2() == Approx(2.5 * 2.5 * 4.0));
    for (int k = 0; k < 20'000; ++k) distances.add(9.0);
    CHECK(distances.limit2() == Approx(2.5 * 2.5 * 9.0));
    for (int k = 0; k < 50'000; ++k) distances.add(0.0);
    CHECK(distances.limit2() == Approx(1e-10));
}
