#include "levelset/motion/advection.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/layers/layer_depths.hpp"
#include "surface/error.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

// Error of the mean radius, relative to it, after a sphere of radius 1 moved by `shift` with dx = 1 / cells.
double sphere_error(int cells, double shift, Scheme scheme, TimeIntegration time) {
    const double radius = cells, end = radius + shift * radius;
    const Domain domain = test::unit_domain(2 * static_cast<int>(std::max(radius, end)) + 14);
    MaterialStack stack{domain, {{0, test::sphere_grid(domain, radius)}}};
    test::move(stack, std::abs(shift) * radius, {scheme, time, 0.5},
               [&](std::size_t, const Vec3&) { return shift > 0 ? 1.0 : -1.0; });
    return std::abs(test::radius_error(extract_surface(stack.top(), domain), end).mean) / radius;
}

}  // namespace

TEST_CASE("a sphere grows and shrinks with the order of the scheme") {
    struct Row {
        Scheme scheme;
        TimeIntegration time;
        double least_order;
    };
    // WENO schemes are limited to second order by the linear interpolation of marching cubes and the
    // re-distancing.
    for (const Row& row :
         {Row{Scheme::engquist_osher, TimeIntegration::euler, 0.9},
          Row{Scheme::weno3, TimeIntegration::rk2, 1.7}, Row{Scheme::weno5, TimeIntegration::rk3, 1.7}})
        for (const double shift : {0.25, -0.25}) {
            const double coarse = sphere_error(12, shift, row.scheme, row.time);
            const double fine = sphere_error(24, shift, row.scheme, row.time);
            CAPTURE(static_cast<int>(row.scheme), shift, coarse, fine);
            CHECK(std::log2(coarse / fine) > row.least_order);
        }
}

TEST_CASE("a sphere of 100 dx grown by 3 dx keeps its radius to 0.005 dx and its roundness to 0.01 dx",
          "[slow]") {
    const Domain domain = test::unit_domain(214);
    for (const Scheme scheme : {Scheme::weno3, Scheme::weno5}) {
        MaterialStack stack{domain, {{0, test::sphere_grid(domain, 100)}}};
        test::move(stack, 3.0, {scheme, TimeIntegration::euler, 0.5},
                   [](std::size_t, const Vec3&) { return 1.0; });
        const auto error = test::radius_error(extract_surface(stack.top(), domain), 103);
        CAPTURE(error.mean, error.deviation);
        CHECK(std::abs(error.mean) <= 0.005);
        CHECK(error.deviation <= 0.01);
    }
}

namespace {

// Height after two time steps of a plane that sinks at dz/dt = -rate z.
double sunken(TimeIntegration scheme, double start, double rate, double dt) {
    const Domain domain = test::unit_domain(8);
    const auto motion_of = [&](const MaterialStack& stack) {
        const TriangleMesh surface = extract_surface(stack.top(), domain);
        Extension extension = extend(stack.top(), domain, surface::RayScene(surface));
        std::vector<double> height;
        for (const SurfaceSample& sample : extension.samples)
            height.push_back(sample.node.z() + static_cast<double>(sample.foot.z()));
        return test::motion_of(
            stack, std::move(extension),
            {.speed = [rate, height = std::move(height)](std::size_t n, std::size_t, const Vec3&) {
                return -rate * height[n];
            }});
    };
    Shape wafer;
    wafer.top = start;
    MaterialStack stack = make_stack(domain, {{0, wafer}});
    const AdvectionOptions options{Scheme::weno3, scheme, 0.5};
    for (int n = 0; n < 2; ++n) {
        std::vector<Motion> motions;
        while (motions.size() < stage_count(scheme)) {
            MaterialStack reached = copy(stack);
            if (!motions.empty()) advect_to_stage(reached, motions, dt, options);
            motions.push_back(motion_of(reached));
        }
        advect(stack, motions, dt, options);
    }
    return extract_surface(stack.top(), domain).vertices.front().z();
}

}  // namespace

TEST_CASE("speeds found again at every stage give the order of the time integration") {
    constexpr double kStart = 1.2, kRate = 0.4, kStep = 1.0, x = kRate * kStep;
    // The Taylor polynomial of exp(-x) up to the scheme's order.
    const std::pair<TimeIntegration, double> schemes[] = {
        {TimeIntegration::euler, 1.0 - x},
        {TimeIntegration::rk2, 1.0 - x + x * x / 2.0},
        {TimeIntegration::rk3, 1.0 - x + x * x / 2.0 - x * x * x / 6.0}};
    for (const auto& [scheme, factor] : schemes)
        CHECK(sunken(scheme, kStart, kRate, kStep) == Approx(kStart * factor * factor).epsilon(1e-4));
}

TEST_CASE("first-order upwinding errs by its truncation error on a sphere") {
    // First-order upwind differences of a distance are too small by dx/2 sum |n_i| phi_ii, whose mean over a
    // sphere is 3/8 dx/r.
    const Domain domain = test::unit_domain(114);
    MaterialStack stack{domain, {{0, test::sphere_grid(domain, 50)}}};
    test::move(stack, 3.0, {Scheme::engquist_osher, TimeIntegration::euler, 0.5},
               [](std::size_t, const Vec3&) { return 1.0; });
    const auto error = test::radius_error(extract_surface(stack.top(), domain), 53);
    const double predicted = -3.0 * 0.375 / 51.5;
    CHECK(error.mean == Approx(predicted).epsilon(0.2));
}

TEST_CASE("uniform growth of a trench is its exact offset") {
    // Closed form: flats and walls move by d, convex edges become arcs of radius d, concave corners stay
    // sharp. The grid cuts 0.35 to 0.58 dx off an arc, depending on where in a cell the edge begins. No front
    // ever lies on nodes here, where rounding would decide its side.
    const Domain domain = test::unit_domain(42);
    Shape shape;
    shape.kind = ShapeKind::trench;
    shape.top = 0.25;
    shape.width = 17.5;
    shape.depth = 20.3;
    const double d = 6.0;
    MaterialStack stack = make_stack(domain, {{0, shape}});
    test::move(stack, d, {Scheme::weno5, TimeIntegration::rk3, 0.5},
               [](std::size_t, const Vec3&) { return 1.0; });
    const TriangleMesh mesh = extract_surface(stack.top(), domain);
    const double half = 8.75, floor = -20.3;
    double flats = 0, arcs = 0, corners = 0;
    for (const Vec3& p : mesh.vertices) {
        const double x = std::abs(p.x()), z = p.z() - shape.top;
        if (x > half && z > 0)
            flats = std::max(flats, std::abs(z - d));
        else if (z > 0)
            arcs = std::max(arcs, std::abs(std::hypot(x - half, z) - d));
        else if (z > floor + d + 2)
            flats = std::max(flats, std::abs(x - (half - d)));
        else if (x < half - d - 2)
            flats = std::max(flats, std::abs(z - floor - d));
        else
            corners = std::max(corners, std::min(std::abs(x - (half - d)), std::abs(z - floor - d)));
    }
    CHECK(flats < 0.1);
    CHECK(arcs < 0.4);
    CHECK(corners < 1.0);
}

TEST_CASE("an etch that reaches another material within a time step goes on with that material's speed") {
    // A film of 1.3 dx on a substrate. Once it is gone, the substrate etches at its own speed, or stays at 0.
    const Domain domain = test::unit_domain(16);
    Shape substrate, film;
    film.top = 1.3;
    for (const double substrate_speed : {0.0, -0.5}) {
        MaterialStack stack = make_stack(domain, {{0, substrate}, {1, film}});
        test::move(stack, 4.0, {Scheme::engquist_osher, TimeIntegration::euler, 0.5},
                   [&](std::size_t layer, const Vec3&) { return layer == 1 ? -1.0 : substrate_speed; });
        const TriangleMesh mesh = extract_surface(stack.top(), domain);
        const double expected = substrate_speed * (4.0 - 1.3);
        for (const Vec3& p : mesh.vertices) REQUIRE(p.z() == Approx(expected).margin(0.03));
        REQUIRE(exposed_material(stack, mesh.vertices.front()) == 0);
    }
}

TEST_CASE("an etch through a film goes on below it though a mask lies between elsewhere") {
    // In its window the mask layer coincides with the substrate. The time step that ends the film must go on
    // etching the substrate there.
    const Domain domain = test::unit_domain(24);
    Shape substrate, mask;
    mask.kind = ShapeKind::trench;
    mask.top = 4.0;
    mask.width = 14.0;
    mask.depth = std::numeric_limits<double>::infinity();
    MaterialStack stack = make_stack(domain, {{0, substrate}, {1, mask}});
    begin_film(stack, 2);
    test::move(stack, 1.3, {Scheme::weno3, TimeIntegration::euler, 0.5},
               [](std::size_t, const Vec3&) { return 1.0; });
    test::move(stack, 4.0, {Scheme::weno3, TimeIntegration::euler, 0.5},
               [](std::size_t layer, const Vec3& n) {
                   return layer == 1 ? 0.0 : -std::max(0.0, n.z()) * (layer == 2 ? 1.0 : 0.5);
               },
               {0.5, 0.0, 1.0});
    int seen = 0;
    for (const Vec3& p : extract_surface(stack.top(), domain).vertices) {
        if (std::abs(p.x()) > 3.0) continue;
        ++seen;
        REQUIRE(p.z() == Approx(-0.5 * (4.0 - 1.3)).margin(0.05));
    }
    CHECK(seen > 5);
}

TEST_CASE("a periodic domain moves like its shifted copy") {
    const auto volume = [](double offset) {
        const Domain domain = test::unit_domain(32, Side::periodic);
        MaterialStack stack{domain, {}};
        Shape hole;
        hole.kind = ShapeKind::hole;
        hole.radius = 7.2;
        hole.depth = 9.4;
        hole.position = {offset, offset};
        stack = make_stack(domain, {{0, hole}});
        test::move(stack, 3.0, {Scheme::weno3, TimeIntegration::rk2, 0.5},
                   [](std::size_t, const Vec3&) { return -1.0; });
        const TriangleMesh mesh = extract_surface(stack.top(), domain);
        double sum = 0;  // of z over the footprint: the volume above z = 0
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            sum += 0.5 * area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
        return sum;
    };
    // Shifts by whole cells give the same stencils, wherever the sides cut the hole.
    CHECK(volume(0.0) == Approx(volume(16.0)).epsilon(1e-4));
    CHECK(volume(0.0) == Approx(volume(5.0)).epsilon(1e-4));
}

TEST_CASE("a speed that is not finite is reported with its place") {
    const Domain domain = test::unit_domain(16);
    MaterialStack stack = make_stack(domain, {{0, Shape{}}});
    const auto motion =
        test::motion_of(stack, extend_untraced(stack, nullptr, false),
                        {.speed = [](std::size_t, std::size_t, const Vec3&) { return std::nan(""); }});
    CHECK_THROWS_AS(max_speed(stack, motion), NumericsError);
}
