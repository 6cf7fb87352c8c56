#include "levelset/motion/geometric.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/layers/layer_depths.hpp"
#include "levelset/layers/make_stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

constexpr double kDx = 0.1;

// Volume between z = 0 and a layer's front, over the domain.
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
    // Marching cubes cuts half a square cell off both rims, each 2 long, and puts faces on nodes, 20 in area,
    // kNodeClearance cells beside them.
    CHECK(silicon == Approx(-8.0).margin(2.0 * kDx * kDx + 20.0 * surface::kNodeClearance * kDx));
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

namespace {

Shape square(double half, bool openings = true) {
    Shape shape;
    shape.kind = ShapeKind::mask;
    shape.polygons = {{{-half, -half}, {half, -half}, {half, half}, {-half, half}}};
    shape.openings = openings;
    return shape;
}

// Silicon (0) under films of 0.55 of oxide (1), 0.35 of nitride (2) and 0.4 of oxide again, over 4 x 4.
MaterialStack films() {
    const Domain domain = make_domain({4.0, 4.0}, kDx, {Side::reflective, Side::periodic});
    const auto plane = [](double top) { return Shape{.kind = ShapeKind::plane, .top = top}; };
    return make_stack(domain, {{0, plane(-1.03)}, {1, plane(-0.48)}, {2, plane(-0.13)}, {1, plane(0.27)}});
}

// Volume of a layer itself, without the layers below.
double own_volume(const MaterialStack& stack, std::size_t layer) {
    return volume(stack, layer) - (layer > 0 ? volume(stack, layer - 1) : 0.0);
}

// Bound on what marching cubes cuts off a square opening 0.5 deep: half a square cell along its edges.
constexpr double kEdges = 0.5 * kDx * kDx * (2 * 8.0 + 4 * 0.5);

}  // namespace

TEST_CASE("a mask is spun on to a flat top and open where its polygons are, or where they are not") {
    for (const bool openings : {true, false}) {
        MaterialStack stack = trench();
        const double before = volume(stack, 1);
        mask(stack, 3, square(0.63, openings), 0.43, false);
        REQUIRE(stack.layers.size() == 3);
        // The mask's top is flat at 0.93, also over the trench, which it fills.
        const double area = 1.26 * 1.26, inside = area * (0.93 + 2.0), all = 12.0 * 0.93 - before;
        CAPTURE(openings);
        CHECK(volume(stack, 2) - before == Approx(openings ? all - inside : inside).margin(0.06));
        CHECK(volume(stack, 1) == Approx(before).margin(1e-3));
        const bool covered = exposed_material(stack, {2.5, 0.0, openings ? 0.93 : 0.5}) == 3;
        CHECK(covered == openings);
        if (openings)
            CHECK(exposed_material(stack, {0.0, 0.0, -2.0}) == 0);
        else
            CHECK(std::abs(distance_at(stack.top(), stack.domain, {0.0, 0.0, 0.93})) < 0.02 * kDx);
    }
}

TEST_CASE("a conformal mask has its thickness on walls and floor, and vertical walls of its own") {
    MaterialStack stack = trench();
    Shape hole;
    hole.kind = ShapeKind::hole;
    hole.radius = 0.4;
    hole.position = {0.0, -0.5};
    mask(stack, 3, hole, 0.25, true);
    for (const Vec3& p : {Vec3(2.5, 0.5, 0.75), Vec3(-0.75, 0.5, -0.5), Vec3(0.0, 0.5, -1.75)}) {
        CHECK(std::abs(distance_at(stack.top(), stack.domain, p)) < 0.1 * kDx);
        CHECK(exposed_material(stack, p) == 3);
    }
    CHECK(exposed_material(stack, {0.0, -0.5, -2.0}) == 0);
    CHECK(std::abs(distance_at(stack.top(), stack.domain, {0.4, -0.5, -1.87})) < 0.1 * kDx);
}

TEST_CASE("a mask leaves gas that is shut in as it is") {
    const Domain domain = make_domain({4.0, 4.0}, kDx, {Side::reflective, Side::periodic});
    const double y = GENERATE(0.0, 1.25, 1.9);  // or beside a periodic side, or across it
    Shape cavity{
        .kind = ShapeKind::sphere, .position = {0.0, y}, .radius = 0.7, .subtract = true, .centre_z = -1.2};
    Shape pit{
        .kind = ShapeKind::box, .position = {1.3, 0.0}, .height = 2.0, .size = {0.8, 0.8}, .subtract = true};
    pit.top = -1.6;
    MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, cavity}, {2, pit}});
    const double before = volume(stack, 0);
    mask(stack, 3, square(0.3), 0.5, false);
    // The pit is filled, the cavity is not.
    const double film = (16.0 - 0.6 * 0.6) * 0.5 + 0.8 * 0.8 * 1.6;
    CHECK(volume(stack, 1) - before == Approx(film).margin(kEdges + 0.02));
    CHECK(distance_at(stack.top(), domain, {0.0, y, -1.0}) > 0.0);
    CHECK(std::abs(distance_at(stack.top(), domain, {0.7, y, -1.2})) < 0.05 * kDx);
}

TEST_CASE("a cut takes the named materials away, wherever they lie, down to its bottom") {
    const double area = 2.46 * 2.46;
    {
        MaterialStack stack = films();
        cut(stack, std::vector{1}, square(1.23), -0.33);
        REQUIRE(stack.layers.size() == 4);
        // Only the upper oxide is cut: the lower one begins at -0.48.
        CHECK(own_volume(stack, 3) == Approx((16.0 - area) * 0.4).margin(kEdges));
        for (const std::size_t k : {1, 2})
            CHECK(own_volume(stack, k) == Approx(own_volume(films(), k)).margin(0.01));
        CHECK(exposed_material(stack, {0.0, 0.0, -0.13}) == 2);
        CHECK(exposed_material(stack, {1.8, 0.0, 0.27}) == 1);
    }
    {  // Both oxides are cut: the nitride between them stays where it was, hanging.
        MaterialStack stack = films();
        cut(stack, std::vector{1}, square(1.23), -INFINITY);
        CHECK(own_volume(stack, 1) == Approx((16.0 - area) * 0.55).margin(kEdges));
        CHECK(own_volume(stack, 2) == Approx(16.0 * 0.35).margin(kEdges));
        CHECK(own_volume(stack, 3) == Approx((16.0 - area) * 0.4).margin(kEdges));
        CHECK(exposed_material(stack, {0.0, 0.0, -0.13}) == 2);
        CHECK(exposed_material(stack, {0.0, 0.0, -0.48}) == 2);
        CHECK(exposed_material(stack, {0.0, 0.0, -1.03}) == 0);
    }
    {  // All three films are cut, and the silicon down to -1.52.
        MaterialStack stack = films();
        cut(stack, std::vector{0, 1, 2}, square(1.23), -1.52);
        CHECK(volume(stack, 3) == Approx(16.0 * 0.27 - area * 1.79).margin(2 * kEdges));
        CHECK(own_volume(stack, 2) == Approx((16.0 - area) * 0.35).margin(kEdges));
        CHECK(exposed_material(stack, {0.0, 0.0, -1.52}) == 0);
        CHECK(exposed_material(stack, {1.23, 0.0, -0.3}) == 2);
    }
    MaterialStack stack = films();
    CHECK_THROWS_AS(cut(stack, std::vector{0}, square(1.0), -INFINITY), GeometryError);
    CHECK_THROWS_AS(cut(stack, std::vector{1}, Shape{}, -1.0), GeometryError);
}

TEST_CASE("a film thinner than a cell is cut away whole") {
    MaterialStack stack = films();
    conformal(stack, 5, 0.3 * kDx);
    cut(stack, std::vector{5}, square(1.23), -INFINITY);
    CHECK(own_volume(stack, 4) == Approx((16.0 - 2.46 * 2.46) * 0.3 * kDx).margin(0.02));
    CHECK(exposed_material(stack, {0.0, 0.0, 0.27}) == 1);
}

TEST_CASE("films thinner than a cell stay where nothing below them is stripped") {
    MaterialStack stack = trench();
    conformal(stack, 4, 0.3 * kDx);
    mask(stack, 3, square(0.63, false), 0.43, false);
    conformal(stack, 5, 0.4 * kDx);
    strip(stack, 3);
    REQUIRE(stack.layers.size() == 4);
    // Area of the film: floor and tops 12, walls 10.
    CHECK(own_volume(stack, 2) == Approx(0.3 * kDx * (12.0 + 10.0)).margin(0.03));
    CHECK(exposed_material(stack, {2.5, 0.5, 0.5 + 0.7 * kDx}) == 5);
    CHECK(std::abs(distance_at(stack.top(), stack.domain, {2.5, 0.5, 0.5 + 0.7 * kDx})) < 0.05 * kDx);
}

TEST_CASE("a stripped film thinner than a cell leaves nothing behind, but the film above it closes the gap") {
    MaterialStack stack = films();
    conformal(stack, 5, 0.3 * kDx);
    mask(stack, 3, square(1.23, false), 0.5, false);
    strip(stack, 5);
    REQUIRE(stack.layers.size() == 5);
    CHECK(exposed_material(stack, {1.8, 0.0, 0.27}) == 1);
    CHECK(std::abs(distance_at(stack.top(), stack.domain, {1.8, 0.0, 0.27})) < 0.05 * kDx);
    CHECK(own_volume(stack, 4) == Approx(2.46 * 2.46 * (0.5 + 0.3 * kDx)).margin(kEdges));
    CHECK(own_volume(stack, 3) == Approx(16.0 * 0.4).margin(0.03));
}
