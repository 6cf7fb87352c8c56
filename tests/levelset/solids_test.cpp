#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "levelset/layers/layer_depths.hpp"
#include "levelset/meshes/pieces.hpp"
#include "levelset/shapes/make_body.hpp"
#include "surface/error.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

constexpr double kPi = std::numbers::pi;

Shape shape(ShapeKind kind) {
    Shape s;
    s.kind = kind;
    return s;
}

Shape sphere(double radius, double z) {
    Shape s = shape(ShapeKind::sphere);
    s.radius = radius;
    s.centre_z = z;
    return s;
}

Shape cylinder(double radius, int axis, double length, double z) {
    Shape s = sphere(radius, z);
    s.kind = ShapeKind::cylinder;
    s.axis = axis;
    s.length = length;
    return s;
}

Shape gap(double length, double width, double height, double z) {
    Shape s = shape(ShapeKind::gap);
    s.length = length;
    s.width = width;
    s.height = height;
    s.centre_z = z;
    return s;
}

Shape box(double x, double y, double height, double radius, double taper_deg = 0.0) {
    Shape s = shape(ShapeKind::box);
    s.size = {x, y};
    s.height = height;
    s.radius = radius;
    s.taper_deg = taper_deg;
    return s;
}

Shape cut_out(Shape s) {
    s.subtract = true;
    return s;
}

// Volume that one more shape adds to (or, negative, takes from) a wafer of 40 x 40 cells up to z = 0.
double added(const Shape& s) {
    const Domain domain = test::unit_domain(40);
    return test::volume_above_zero(make_stack(domain, {{0, Shape{}}, {1, s}}).top(), domain);
}

// Bound on the error of a volume from marching cubes: chords of curved faces, at most a cell's diagonal long,
// lie up to sqrt(3)^2 / (8 r) off the arc; sharp edges lose half a cell's area; touching bodies overlap by
// less than 1e-3 cells.
double tolerance(double area, double curved, double radius, double edges) {
    return 3.0 / (8.0 * radius) * curved + 0.5 * edges + 1e-3 * area;
}

}  // namespace

TEST_CASE("spheres, cylinders and gaps that are cut out leave cavities of their volumes") {
    const double r = 9.3;
    CHECK(added(cut_out(sphere(r, -15.3))) ==
          Approx(-4.0 / 3.0 * kPi * r * r * r).margin(tolerance(4 * kPi * r * r, 4 * kPi * r * r, r, 0)));
    const double side = 2 * kPi * r;
    for (const int axis : {0, 1}) {
        CHECK(added(cut_out(cylinder(r, axis, INFINITY, -15.3))) ==
              Approx(-kPi * r * r * 40).margin(tolerance(side * 40, side * 40, r, 0)));
        CHECK(added(cut_out(cylinder(r, axis, 17.4, -15.3))) ==
              Approx(-kPi * r * r * 17.4)
                  .margin(tolerance(side * 17.4 + 2 * kPi * r * r, side * 17.4, r, 2 * side)));
    }
    CHECK(added(cut_out(cylinder(r, 2, 17.4, -15.3))) ==
          Approx(-kPi * r * r * 17.4)
              .margin(tolerance(side * 17.4 + 2 * kPi * r * r, side * 17.4, r, 2 * side)));
    CHECK(added(cut_out(gap(21.3, 14.6, 5.5, -10.2))) ==
          Approx(-21.3 * 14.6 * 5.5)
              .margin(tolerance(2 * (21.3 * 14.6 + 5.5 * 36), 0, 1, 4 * (21.3 + 14.6 + 5.5))));
    CHECK(added(cut_out(gap(21.3, INFINITY, 5.5, -10.2))) ==
          Approx(-21.3 * 40 * 5.5).margin(tolerance(2 * 40 * 27, 0, 1, 4 * 40)));
}

TEST_CASE("a sphere adds its cap, and half of it is a bump") {
    const double r = 12.7;
    CHECK(added(sphere(r, 0.0)) == Approx(2.0 / 3.0 * kPi * r * r * r)
                                       .margin(tolerance(2 * kPi * r * r, 2 * kPi * r * r, r, 2 * kPi * r)));
}

TEST_CASE("cut-out volumes converge with the square of the spacing") {
    double error[2];
    for (int level = 0; level < 2; ++level) {
        const double dx = level == 0 ? 0.5 : 0.25;
        const Domain domain = make_domain({10.0, 10.0}, dx, {Side::reflective, Side::reflective});
        const MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, cut_out(sphere(3.1, -5.03))}});
        // The cut-out sphere is larger by a shell, here taken to be 1e-3 dx thick.
        const double r = 3.1 + 1e-3 * dx;
        error[level] = std::abs(test::volume_above_zero(stack.top(), domain) + 4.0 / 3.0 * kPi * r * r * r);
    }
    CHECK(std::log2(error[0] / error[1]) > 1.6);
}

TEST_CASE("rounded boxes have their volumes, standing and cut out") {
    const double a = 17.4, b = 21.2, c = 12.3, r = 4.0, u = a - 2 * r, v = b - 2 * r, w = c - 2 * r;
    const double closed = u * v * w + 2 * r * (u * v + v * w + w * u) + kPi * r * r * (u + v + w) +
                          4.0 / 3.0 * kPi * r * r * r,
                 area = 2 * (a * b + b * c + c * a);
    Shape cavity = cut_out(box(a, b, c, r));
    cavity.top = -20.3;
    CHECK(added(cavity) == Approx(-closed).margin(tolerance(area, area, r, 0)));
    // The upper half is round; below, walls with rounded vertical edges reach the wafer.
    const double standing = 0.5 * closed + (u * v + 2 * r * (u + v) + kPi * r * r) * 0.5 * c;
    CHECK(added(box(a, b, c, r)) == Approx(standing).margin(tolerance(area, area, r, 2 * (a + b))));
    // A sharp box as a cavity; a radius near 0 makes a sharp box.
    Shape sharp = cut_out(box(a, b, c, 0.0));
    sharp.top = -20.3;
    CHECK(added(sharp) == Approx(-a * b * c).margin(tolerance(area, 0, 1, 4 * (a + b + c))));
    CHECK(added(box(a, b, c, 1e-6)) == Approx(added(box(a, b, c, 0.0))).margin(0.01 * area));
}

TEST_CASE("a parabola turned about the axis, or drawn out along y, has its volume") {
    Shape bump = shape(ShapeKind::profile);
    const double radius = 15.2, height = 9.7;
    for (int k = 0; k <= 200; ++k) {
        const double x = radius * k / 200;
        bump.profile.push_back({x, height * (1 - x * x / (radius * radius))});
    }
    const double area = kPi * radius * std::hypot(radius, height) * 1.2;
    CHECK(added(bump) ==
          Approx(0.5 * kPi * radius * radius * height)
              .margin(tolerance(area, area, 0.5 * radius * radius / height, 2 * kPi * radius)));
    bump.profile.clear();
    for (int k = -200; k <= 200; ++k) {
        const double x = radius * k / 200;
        bump.profile.push_back({x, height * (1 - x * x / (radius * radius))});
    }
    bump.revolved = false;
    CHECK(added(bump) == Approx(4.0 / 3.0 * radius * height * 40)
                             .margin(tolerance(40 * 50, 40 * 50, 0.5 * radius * radius / height, 80)));
    // The curve upside down, cut out, is a channel of the same volume.
    for (auto& p : bump.profile) p[1] = -p[1];
    CHECK(added(cut_out(bump)) ==
          Approx(-4.0 / 3.0 * radius * height * 40)
              .margin(tolerance(40 * 50, 40 * 50, 0.5 * radius * radius / height, 80)));
}

TEST_CASE("a trench goes through a wafer of any size, in whatever unit lengths are") {
    for (const double spacing : {1e-9, 1.0, 1e4}) {
        const Domain domain =
            make_domain({60.0 * spacing, 60.0 * spacing}, spacing, {Side::reflective, Side::reflective});
        Shape trench = shape(ShapeKind::trench);
        trench.width = 6.0 * spacing, trench.depth = 5.0 * spacing;
        const TriangleMesh mesh = extract_surface(make_stack(domain, {{0, trench}}), 0);
        double flat = 0.0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) flat += area_vector(mesh, t).z();
        CHECK(flat == Approx(2.0 * 3600.0 * spacing * spacing));
    }
}

TEST_CASE("a profile that lies on one side of its origin is whole on a periodic wafer") {
    const Domain domain = test::unit_domain(40, Side::periodic);
    Shape block = shape(ShapeKind::profile);
    block.revolved = false;
    block.profile = {{0.0, 0.0}, {30.0, 0.0}, {30.0, 10.3}, {0.0, 10.3}, {0.0, 0.0}};
    for (const double x : {-15.2, 3.1}) {
        block.position = {x, 0.0};
        const double volume =
            test::volume_above_zero(make_stack(domain, {{0, Shape{}}, {1, block}}).top(), domain);
        CHECK(volume == Approx(30.0 * 10.3 * 40.0).margin(tolerance(4000.0, 0.0, 1.0, 160.0)));
    }
}

TEST_CASE("an outline that runs along its axis of revolution has no wall there") {
    Shape ball = shape(ShapeKind::profile);
    const double r = 9.3;
    for (int k = 0; k <= 180; ++k)
        ball.profile.push_back(
            {k == 0 || k == 180 ? 0.0 : r * std::sin(kPi * k / 180), -r * std::cos(kPi * k / 180)});
    ball.profile.push_back(ball.profile.front());
    const Domain domain = test::unit_domain(40);
    const Body body = make_body(ball, domain);
    for (const double z : {-5.0, 0.0, 3.0})
        CHECK(body.distance({0, 0, z}) == Approx(std::abs(z) - r).margin(1e-3 * r));
    CHECK(body.distance({3, 4, 0}) == Approx(5 - r).margin(1e-3 * r));
    CHECK(body.distance({0, 0, 2 * r}) == Approx(r).margin(1e-3 * r));
    ball.top = -15.3;
    CHECK(added(cut_out(ball)) ==
          Approx(-4.0 / 3.0 * kPi * r * r * r).margin(tolerance(4 * kPi * r * r, 4 * kPi * r * r, r, 0)));
}

TEST_CASE("a cut goes through all layers below and leaves those above") {
    const Domain domain = test::unit_domain(40);
    Shape oxide, nitride;
    oxide.top = 5.0;
    nitride.top = 9.4;
    Shape hole = cut_out(shape(ShapeKind::hole));
    hole.radius = 8.2;
    hole.depth = 12.4;
    hole.top = 5.0;
    const MaterialStack through = make_stack(domain, {{0, Shape{}}, {1, oxide}, {7, hole}});
    REQUIRE(through.layers.size() == 2);
    CHECK(exposed_material(through, {0, 0, -7.4}) == 0);
    CHECK(exposed_material(through, {8.2, 0, -4}) == 0);
    CHECK(exposed_material(through, {8.2, 0, 3}) == 1);
    const double area = kPi * 8.2 * 8.2;
    CHECK(test::volume_above_zero(through.top(), domain) ==
          Approx(5.0 * 1600 - area * 12.4)
              .margin(tolerance(2 * kPi * 8.2 * 12.4 + area, 2 * kPi * 8.2 * 12.4, 8.2, 4 * kPi * 8.2)));
    // The next layer fills the hole.
    const MaterialStack filled = make_stack(domain, {{0, Shape{}}, {1, oxide}, {7, hole}, {2, nitride}});
    REQUIRE(filled.layers.size() == 3);
    CHECK(test::volume_above_zero(filled.top(), domain) == Approx(9.4 * 1600).margin(1.0));
    CHECK(test::volume_above_zero(*filled.layers[1].phi, domain) ==
          Approx(test::volume_above_zero(through.top(), domain)).margin(1.0));
    CHECK_THROWS_AS(make_stack(domain, {{7, hole}}), GeometryError);
}

TEST_CASE("cuts that touch, or end flush with the surface, leave no wall between them") {
    const Domain domain = test::unit_domain(40);
    Shape trench = cut_out(shape(ShapeKind::trench));
    trench.width = 10.0;  // its walls and the gap's end lie on nodes
    trench.depth = 14.0;
    Shape side = cut_out(gap(10.0, INFINITY, 5.0, -11.5));  // its floor is the trench's
    side.position = {10.0, 0.0};
    const MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, trench}, {2, side}});
    const TriangleMesh surface = extract_surface(stack.top(), domain);
    CHECK(surface_pieces(surface, domain).size() == 1);
    CHECK(test::volume_above_zero(stack.top(), domain) ==
          Approx(-(10.0 * 14.0 + 10.0 * 5.0) * 40).margin(tolerance(40 * 60, 0, 1, 40 * 8)));
}

TEST_CASE("bodies are negative inside, and no two values differ by more than the points' distance") {
    const Domain domain = make_domain({40.0, 40.0}, 1.0, {Side::periodic, Side::reflective});
    Shape profile = shape(ShapeKind::profile);
    profile.profile = {{0, 5}, {4, 6}, {6, -2}, {3, -3}, {8, -8}};
    Shape tapered = cut_out(shape(ShapeKind::hole));
    tapered.radius = 7.0;
    tapered.depth = 6.0;
    tapered.taper_deg = 20.0;
    Shape fin = cut_out(shape(ShapeKind::fin));
    fin.width = 8.0;
    fin.height = 6.0;
    fin.taper_deg = -15.0;
    Shape bar = shape(ShapeKind::mask);
    bar.polygons = {{{-5, -5}, {6, -4}, {2, 7}}};
    bar.top = 4.0;
    bar.base = -3.0;
    bar.openings = false;
    struct Row {
        Shape shape;
        Vec3 within, beyond;
    };
    const Row rows[] = {{sphere(6, 1), {0, 0, 1}, {0, 0, 8}},
                        {cylinder(5, 0, 12, 0), {5, 0, 0}, {7, 0, 0}},
                        {cylinder(5, 2, 12, 0), {0, 0, 5}, {0, 0, 7}},
                        {gap(12, 8, 4, 0), {5, 3, 1}, {5, 5, 1}},
                        {box(12, 10, 8, 2, 10), {0, 0, 7}, {5.9, 4.9, 7.9}},
                        {cut_out(box(12, 10, 8, 2, -20)), {0, 0, 7}, {0, 0, -1}},
                        {profile, {0, 0, 4}, {0, 0, 7}},
                        {cut_out(profile), {0, 0, 7}, {0, 0, 4}},
                        {tapered, {0, 0, -5}, {6.5, 0, -5}},
                        {fin, {4.5, 0, 5}, {4.5, 0, 1}},
                        {bar, {0, 0, 0}, {0, 0, -4}}};
    std::mt19937 random(1);
    std::uniform_real_distribution<double> anywhere(-20, 20), near(-0.7, 0.7);
    for (const Row& row : rows) {
        const Body body = make_body(row.shape, domain);
        CAPTURE(static_cast<int>(row.shape.kind), row.shape.subtract);
        CHECK(body.distance(row.within) < 0.0);
        CHECK(body.distance(row.beyond) > 0.0);
        double steepest = 0.0;
        for (int n = 0; n < 4000; ++n) {
            const Vec3 p(anywhere(random), anywhere(random), anywhere(random)),
                q = p + Vec3(near(random), near(random), near(random));
            steepest = std::max(steepest, std::abs(body.distance(p) - body.distance(q)) / (p - q).norm());
        }
        CHECK(steepest <= 1.0 + 1e-9);
    }
}

TEST_CASE("lengths that make no body are refused") {
    const Domain domain = test::unit_domain(40);
    Shape negative = shape(ShapeKind::profile);
    negative.profile = {{-1, 0}, {3, 2}, {5, 0}};
    for (const Shape& s : {sphere(0, 0), cylinder(0, 0, 1, 0), cylinder(1, 2, INFINITY, 0), gap(1, 1, 0, 0),
                           box(5, 5, 5, 3), box(5, 8, 1, 2), negative, cut_out(shape(ShapeKind::hole))})
        CHECK_THROWS_AS(make_body(s, domain), GeometryError);
}
