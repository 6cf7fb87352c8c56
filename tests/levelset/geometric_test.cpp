#include "levelset/geometric.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "levelset/extract.hpp"
#include "levelset/layer_depths.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

constexpr double kDx = 0.1;

// Volume below a layer's front, over the domain, from z = 0.
double volume(const MaterialStack& stack, std::size_t layer) {
    const TriangleMesh mesh = extract_surface(*stack.layers[layer].phi, stack.domain);
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += 0.5 * area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
    return sum;
}

// A trench 2 wide and 2 deep in silicon (0), with an oxide (1) of 0.5 on its shoulders.
MaterialStack trench() {
    const Domain domain = make_domain({6.0, 2.0}, kDx, {Side::reflective, Side::periodic});
    Shape silicon{.kind = ShapeKind::trench, .top = 0.0, .width = 2.0, .depth = 2.0};
    Shape mask{.kind = ShapeKind::trench,
               .top = 0.5,
               .width = 2.0,
               .depth = std::numeric_limits<double>::infinity()};
    return make_stack(domain, {{0, silicon}, {1, mask}});
}

}  // namespace

TEST_CASE("fill, planarize and strip leave the volumes they should") {
    MaterialStack stack = trench();
    const double silicon = volume(stack, 0);
    CHECK(silicon == Approx(-8.0).margin(0.02));
    CHECK(volume(stack, 1) - silicon == Approx(4.0).margin(0.05));

    fill(stack, 2, 1.0);
    REQUIRE(stack.layers.size() == 3);
    CHECK(volume(stack, 2) == Approx(12.0).margin(0.01));
    CHECK(volume(stack, 0) == Approx(silicon).margin(1e-6));
    CHECK(exposed_material(stack, {0.0, 0.0, 1.0}) == 2);

    planarize(stack, 0.2);
    CHECK(volume(stack, 2) == Approx(2.4).margin(0.01));
    CHECK(exposed_material(stack, {0.0, 0.0, 0.2}) == 2);
    CHECK(exposed_material(stack, {2.5, 0.0, 0.2}) == 1);
    const TriangleMesh flat = extract_surface(stack.top(), stack.domain);
    for (const Vec3& p : flat.vertices) CHECK(std::abs(p.z() - 0.2) < 0.01 * kDx);

    strip(stack, 1);
    REQUIRE(stack.layers.size() == 2);
    // The plug stands in the trench, 0.2 above the silicon.
    CHECK(volume(stack, 1) == Approx(0.8).margin(0.05));
    CHECK(exposed_material(stack, {2.5, 0.0, 0.0}) == 0);
    strip(stack, 2);
    REQUIRE(stack.layers.size() == 1);
    CHECK(volume(stack, 0) == Approx(silicon).margin(0.02));
    CHECK_THROWS_AS(strip(stack, 0), GeometryError);
}

TEST_CASE("planarize below everything leaves a plane of the substrate, above everything changes nothing") {
    MaterialStack stack = trench();
    const double before = volume(stack, 1);
    planarize(stack, 3.0);
    CHECK(volume(stack, 1) == Approx(before).margin(1e-3));
    planarize(stack, -3.0);
    CHECK(volume(stack, 1) == Approx(-36.0).margin(0.01));
    CHECK(exposed_material(stack, {0.0, 0.0, -3.0}) == 0);
}

TEST_CASE("a conformal film has its thickness on floor, walls and top") {
    MaterialStack stack = trench();
    conformal(stack, 3, 0.45);
    REQUIRE(stack.layers.back().material == 3);
    for (const Vec3& p : {Vec3(2.5, 0, 0.95), Vec3(-0.55, 0, -0.5), Vec3(0.55, 0, -1.0), Vec3(0, 0, -1.55)})
        CHECK(std::abs(distance_at(stack.top(), stack.domain, p)) < 0.1 * kDx);
}
