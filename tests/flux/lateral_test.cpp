#include "flux/lateral.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <string>

#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"

using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;

namespace {

constexpr std::array kOpenSides{Boundary::open, Boundary::open};

TriangleMesh plane() {
    return height_field(4, 4, 2.0, 1.0, [](auto, auto) { return 0.0; });
}

TriangleMesh inside_out(TriangleMesh mesh) {
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

TriangleMesh tetrahedron() {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    return mesh;
}

}  // namespace

TEST_CASE("the box of a surface that ends on a rectangle is that rectangle, to the last bit") {
    const auto mesh = turned(extrude(trench_profile(3.0, 0.1, {}, {}), std::sqrt(2.0)));
    const LateralBox box = lateral_box(mesh, {Boundary::periodic, Boundary::reflective});
    CHECK(box.min[0] == -std::sqrt(2.0));
    CHECK(box.max[0] == 0.0);
    CHECK(box.min[1] == -0.6);
    CHECK(box.max[1] == 0.6);
    CHECK(box.boundary[0] == Boundary::periodic);
    CHECK(box.boundary[1] == Boundary::reflective);
}

TEST_CASE("surfaces that do not end on a rectangle are refused, with the place and the remedy") {
    const auto refused = [](const TriangleMesh& mesh, std::array<Boundary, 2> boundary,
                            const std::string& reason) {
        CAPTURE(reason);
        CHECK_THROWS_AS(lateral_box(mesh, boundary), GeometryError);
        CHECK_THROWS_WITH(lateral_box(mesh, boundary), Contains(reason));
    };
    auto mesh = plane();
    mesh.triangles.erase(mesh.triangles.begin() + 10);
    refused(mesh, kReflective, "has a hole");
    CHECK_NOTHROW(lateral_box(mesh, kOpenSides));
    mesh = plane();
    std::swap(mesh.triangles[10][1], mesh.triangles[10][2]);
    refused(mesh, kPeriodic, "inconsistently oriented");
    mesh = plane();
    mesh.vertices[2].y() -= 1e-3;  // it was on the side y = 0
    refused(mesh, kReflective, "not on a side");
    mesh = plane();
    mesh.triangles.pop_back();  // at a corner: the diagonal is in no side plane
    mesh.triangles.pop_back();
    refused(mesh, kReflective, "not on a side");
    refused(tetrahedron(), kPeriodic, "closed");
    CHECK_NOTHROW(lateral_box(tetrahedron(), kOpenSides));
    refused(inside_out(tetrahedron()), kOpenSides, "inside out");
    refused(inside_out(plane()), kReflective, "inside out");
    refused(inside_out(plane()), kOpenSides, "inside out");
    refused({}, kOpenSides, "no triangle");
    mesh = plane();
    mesh.vertices[3].z() = std::numeric_limits<double>::quiet_NaN();
    refused(mesh, kOpenSides, "vertex 3 is not finite");
    mesh = plane();
    mesh.triangles[5][0] = 999;
    refused(mesh, kOpenSides, "triangle 5 names vertex 999");
    mesh = plane();
    for (Vec3& p : mesh.vertices) p.x() += 1e5;
    refused(mesh, kReflective, "move it to the origin");
    mesh = plane();
    for (Vec3& p : mesh.vertices) p *= 1e-12;
    refused(mesh, kReflective, "choose a unit");
    mesh = plane();
    for (Vec3& p : mesh.vertices) p = Vec3(p.x(), 0.0, p.y());
    refused(mesh, kOpenSides, "no extent along y");
    // Two sheets over the same rectangle cover it twice.
    mesh = plane();
    const auto upper = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t v = 0; v < upper; ++v) mesh.vertices.push_back(mesh.vertices[v] + Vec3::UnitZ());
    for (std::size_t t = 0, n = mesh.triangles.size(); t < n; ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        mesh.triangles.push_back({a + upper, b + upper, c + upper});
    }
    refused(mesh, kPeriodic, "once around");
}

TEST_CASE("a surface has its rim inside the box if its one boundary is not the rectangle's") {
    CHECK_FALSE(lateral_box(plane(), kOpenSides).rim_inside);
    CHECK_FALSE(lateral_box(tetrahedron(), kOpenSides).rim_inside);
    auto mesh = plane();
    mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + 2);  // a corner
    CHECK(lateral_box(mesh, kOpenSides).rim_inside);
    mesh = plane();
    mesh.triangles.erase(mesh.triangles.begin() + 10);  // in the middle
    CHECK_FALSE(lateral_box(mesh, kOpenSides).rim_inside);
}

TEST_CASE("coordinates rounded to single precision still end on their rectangle") {
    auto mesh = turned(extrude(trench_profile(3.0, 0.1, {}, {}), std::sqrt(2.0), 3));
    mesh.vertices[2].x() += 4e-8;
    CHECK_NOTHROW(lateral_box(mesh, kPeriodic));
}

TEST_CASE("a path meets the side ahead of it, at once if it stands on that side") {
    const LateralBox box{{0.0, 0.0}, {2.0, 1.0}, kReflective};
    CHECK(next_side(box, Vec3(0.5, 0.5, 0.0), Vec3(1.0, 0.1, 0.0)).distance == Approx(1.5));
    CHECK(next_side(box, Vec3(0.5, 0.5, 0.0), Vec3(0.1, -1.0, 0.0)).axis == 1);
    CHECK(next_side(box, Vec3(2.0, 0.5, 0.0), Vec3(1.0, 0.1, 0.0)).distance == 0.0);
    CHECK(next_side(box, Vec3(2.0, 0.5, 0.0), Vec3(-1.0, 0.1, 0.0)).distance == Approx(2.0));
    CHECK(std::isinf(next_side(box, Vec3(0.5, 0.5, 0.0), Vec3(0.0, 0.0, -1.0)).distance));
}

TEST_CASE("a path through reflective sides is a straight line folded up, through periodic sides wrapped") {
    // 200 crossings, corners included, against the unfolded line.
    const auto type = GENERATE(Boundary::reflective, Boundary::periodic);
    const Vec3 start(0.25, 0.125, 0.0);
    const Vec3 direction =
        GENERATE(Vec3(1.0, 0.5, -0.3), Vec3(-0.75, 0.875, 0.1), Vec3(0.6, -0.0, 0.2)).normalized();
    const LateralBox box{{0.0, 0.0}, {2.0, 1.0}, {type, type}};
    Vec3 position = start, heading = direction;
    double path = 0.0;
    for (int i = 0; i < 200; ++i) {
        const SideMeeting meeting = next_side(box, position, heading);
        path += meeting.distance;
        REQUIRE(cross_side(box, meeting, position, heading));
        const bool on_side = position[meeting.axis] == box.min[meeting.axis] ||
                             position[meeting.axis] == box.max[meeting.axis];
        CHECK(on_side);
        for (int axis = 0; axis < 2; ++axis) {
            const double length = box.max[axis];
            const double unfolded = start[axis] + path * direction[axis];
            double folded = unfolded - std::floor(unfolded / length) * length;
            if (type == Boundary::reflective && std::abs(std::remainder(unfolded, 2.0 * length)) != folded)
                folded = std::abs(std::remainder(unfolded, 2.0 * length));
            const double apart = std::abs(position[axis] - folded);
            // On a periodic side, both ends are the same place.
            CHECK(std::min(apart, type == Boundary::periodic ? std::abs(length - apart) : apart) < 1e-11);
        }
    }
    CHECK(std::abs(heading.norm() - 1.0) < 1e-15);
}

TEST_CASE("an open side lets the particle go") {
    const LateralBox box{{0.0, 0.0}, {2.0, 1.0}, {Boundary::open, Boundary::periodic}};
    Vec3 position(0.5, 0.5, 0.0), heading(1.0, 0.0, 0.0);
    CHECK_FALSE(cross_side(box, next_side(box, position, heading), position, heading));
    heading = Vec3::UnitY();
    CHECK(cross_side(box, next_side(box, position, heading), position, heading));
}
