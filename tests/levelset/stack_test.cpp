#include "levelset/layers/stack.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "levelset/layers/checkpoint.hpp"
#include "levelset/layers/layer_depths.hpp"
#include "levelset/meshes/grid_curvature.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/redistance.hpp"
#include "levelset/shapes/make_body.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

Shape mask_hole(double radius, double thickness) {
    Shape mask;
    mask.kind = ShapeKind::hole;
    mask.top = thickness;
    mask.radius = radius;
    mask.depth = std::numeric_limits<double>::infinity();
    return mask;
}

// Silicon up to z = \p bottom under a mask with a slit along y.
MaterialStack under_slit_mask(const Domain& domain, double bottom, double thickness, double width) {
    Shape silicon, mask;
    silicon.top = bottom;
    mask.kind = ShapeKind::trench;
    mask.top = bottom + thickness;
    mask.width = width;
    mask.depth = std::numeric_limits<double>::infinity();
    return make_stack(domain, {{0, silicon}, {1, mask}});
}

}  // namespace

TEST_CASE("the material under a point is the lowest layer that reaches the surface there") {
    const Domain domain = test::unit_domain(40);
    const MaterialStack stack = make_stack(domain, {{7, Shape{}}, {9, mask_hole(10, 6)}});
    CHECK(exposed_material(stack, {0.3, 0.2, 0.0}) == 7);
    CHECK(exposed_material(stack, {8.7, 0.0, 0.0}) == 7);
    CHECK(exposed_material(stack, {15.0, 0.0, 6.0}) == 9);
    CHECK(exposed_material(stack, {10.0, 0.0, 3.0}) == 9);
}

TEST_CASE("a layer is all of its bodies united and cut out, though no leaf asks those far from it") {
    const Domain domain = make_domain({31.0, 23.0}, 1.0, {Side::reflective, Side::periodic});
    std::vector<std::pair<int, Shape>> bodies;
    for (int k = 0; k < 9; ++k) bodies.push_back({k, {.kind = ShapeKind::plane, .top = 4.3 * k}});
    bodies.push_back(
        {-1, {.kind = ShapeKind::trench, .top = 34.4, .width = 9.4, .depth = 21.7, .subtract = true}});
    bodies.push_back({9,
                      {.kind = ShapeKind::cylinder,
                       .position = {2.0, 1.0},
                       .radius = 3.3,
                       .centre_z = 20.2,
                       .length = 12.0}});
    bodies.push_back({-1,
                      {.kind = ShapeKind::sphere,
                       .position = {-6.0, 1.0},
                       .radius = 7.1,
                       .subtract = true,
                       .centre_z = 28.3}});
    bodies.push_back(
        {10,
         {.kind = ShapeKind::box, .top = 34.4, .position = {9.0, 0.0}, .height = 6.2, .size = {6.0, 8.0}}});
    std::vector<Body> body;
    for (const auto& [material, shape] : bodies) body.push_back(make_body(shape, domain));
    const double touching = 1e-4;  // by which bodies with an underside and cut-out bodies are enlarged
    const auto united = [&](const Vec3& p) {
        double d = body[0].distance(p);
        for (std::size_t k = 1; k < body.size(); ++k)
            d = bodies[k].second.subtract
                    ? std::max(d, touching - body[k].distance(p))
                    : std::min(d, body[k].distance(p) - (body[k].closed ? touching : 0.0));
        return d;
    };
    const GridPtr sampled = sample_grid(domain, united, -10.0, 50.0);
    std::size_t active = 0, different = 0;
    for (int i = 0; i <= domain.last_node(0); ++i)
        for (int j = 0; j <= domain.last_node(1); ++j)
            for (int k = -10; k < 50; ++k) {
                const openvdb::Coord c(i, j, k);
                const auto d = static_cast<float>(
                    united({domain.coordinate(0, i), domain.coordinate(1, j), domain.coordinate(2, k)}));
                const bool in_band = std::abs(d) < sampled->background();
                active += in_band;
                different +=
                    sampled->tree().isValueOn(c) != in_band || (in_band && sampled->tree().getValue(c) != d);
            }
    CHECK(active > 5000);
    CHECK(different == 0);
    redistance(*sampled, domain, kSweepsAnew);
    const MaterialStack stack = make_stack(domain, bodies);
    CHECK(stack.layers.size() == 11);
    CHECK(stack.top().activeVoxelCount() == sampled->activeVoxelCount());
    for (auto it = sampled->cbeginValueOn(); it; ++it)
        different += !(stack.top().tree().isValueOn(it.getCoord()) &&
                       stack.top().tree().getValue(it.getCoord()) == *it);
    CHECK(different == 0);
}

TEST_CASE("depths asked for leaf by leaf are those asked for point by point") {
    for (const Side side : {Side::reflective, Side::periodic}) {
        const Domain domain = make_domain({21.0, 21.0}, 1.0, {side, side});
        MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, mask_hole(6, 2.5)}});
        begin_film(stack, 2);
        test::move(stack, 0.4, {}, [](std::size_t, const Vec3&) { return 1.0; });
        const LayerDepths single(stack);
        LayerDepths by_leaf(stack);
        std::size_t points = 0;
        for (auto it = stack.top().cbeginValueOn(); it; ++it) {
            if (std::abs(*it) > 0.9f) continue;
            const openvdb::Coord c = it.getCoord();
            const Vec3 point(c.x() + 0.3, c.y() - 0.4, c.z() - 0.8 * static_cast<double>(*it));
            std::array<float, 2> a{}, b{};
            single.at(point, a);
            by_leaf.at(point, {c.x(), c.y(), c.z()}, b);
            REQUIRE(a == b);
            ++points;
        }
        CHECK(points > 400);
    }
}

TEST_CASE("a film grows on all materials and leaves the interfaces below where they were") {
    const Domain domain = test::unit_domain(40);
    MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, mask_hole(10, 6)}});
    const TriangleMesh interface_before = extract_surface(*stack.layers[1].phi, domain);
    begin_film(stack, 2);
    begin_film(stack, 2);  // no effect: the film is there
    REQUIRE(stack.layers.size() == 3);
    test::move(stack, 3.0, {}, [](std::size_t, const Vec3&) { return 1.0; });
    CHECK(exposed_material(stack, {0.0, 0.0, 3.0}) == 2);
    const TriangleMesh interface_after = extract_surface(*stack.layers[1].phi, domain);
    // Where layer and film coincided, the layer took the film's values while these had moved by less than
    // kExposed.
    CHECK(surface::two_sided_distance(interface_after, interface_before).max < kExposed);
    for (const Vec3& p : extract_surface(stack.top(), domain).vertices)
        if (std::hypot(p.x(), p.y()) > 14) REQUIRE(p.z() == Approx(9.0).margin(0.05));
}

TEST_CASE("a film that grows past a thin fence and closes over it leaves the fence where it is") {
    const Domain domain = test::unit_domain(24);
    for (const double width : {1.3, 2.0, 3.1})
        for (const auto& [cfl, height] :
             {std::pair{0.5, 6.0}, {0.1, 6.0}, {0.5, 6.0 - 1e-7}, {0.1, 6.0 + 1e-7}}) {
            const double position = 0.8 * cfl;  // arbitrary
            CAPTURE(width, position, height);
            Shape fence;
            fence.kind = ShapeKind::fin;
            fence.width = width;
            fence.height = height;
            fence.position = {position, 0.0};
            MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, fence}});
            const TriangleMesh before = extract_surface(*stack.layers[1].phi, domain);
            begin_film(stack, 2);
            // The film does not grow on the fence itself.
            test::move(stack, 12.0, {.cfl = cfl},
                       [](std::size_t layer, const Vec3&) { return layer == 1 ? 0.0 : 1.0; });
            const TriangleMesh after = extract_surface(*stack.layers[1].phi, domain);
            // Re-distancing rounds the fence's edges while they are bare.
            CHECK(surface::two_sided_distance(after, before).max < 0.25);
            CHECK(surface::two_sided_distance(after, before).mean < 0.02);
        }
}

TEST_CASE(
    "a mask that does not etch keeps its volume to 1e-3 over 500 time steps of an etch beside and under it",
    "[slow]") {
    const Domain domain = make_domain({64.0, 2.0}, 1.0, {Side::reflective, Side::reflective});
    // The mask's underside at several places between nodes; a nearly vertical and an isotropic etch.
    for (const double bottom : {0.0, 0.3, 0.8})
        for (const double down : {1.0, 0.0}) {
            MaterialStack stack = under_slit_mask(domain, bottom, 20.0, 14.6);
            const double side = down > 0.0 ? 0.05 : 1.0, duration = 8.0, time_steps = 500.0;
            const auto mask_volume = [&] {
                return test::volume_above_zero(stack.top(), domain) -
                       test::volume_above_zero(*stack.layers[0].phi, domain);
            };
            const double before = mask_volume();
            test::move(
                stack, duration,
                {Scheme::weno3, TimeIntegration::euler, (down + side) * duration / time_steps},
                [&](std::size_t layer, const Vec3& n) {
                    return layer == 0 ? -down * std::max(0.0, n.z()) - side : 0.0;
                },
                down > 0.0 ? std::vector{down + side, 0.0} : std::vector<double>{});
            CAPTURE(bottom, down, before);
            CHECK(band_z_range(stack.top(), domain)[0] + kHalfWidth - 1.0 <
                  bottom - 0.95 * (down + side) * duration);
            CHECK(mask_volume() == Approx(before).epsilon(1e-3));
        }
}

TEST_CASE("a mask undercut by four times its thickness loses no more than its lower edges, and less on nodes",
          "[slow]") {
    const Domain domain = make_domain({128.0, 2.0}, 1.0, {Side::reflective, Side::reflective});
    struct Row {
        double bottom, cfl;
    };
    // Three mask positions with long time steps, one with 500.
    for (const Row row : {Row{0.0, 0.5}, Row{0.3, 0.5}, Row{0.8, 0.5}, Row{0.0, 0.08}}) {
        MaterialStack stack = under_slit_mask(domain, row.bottom, 10.0, 20.0);
        const auto volume = [&](const Grid& grid) { return test::volume_above_zero(grid, domain); };
        const auto mask_volume = [&] { return volume(stack.top()) - volume(*stack.layers[0].phi); };
        const double before = mask_volume(), silicon_before = volume(*stack.layers[0].phi);
        test::move(stack, 40.0, {Scheme::weno3, TimeIntegration::euler, row.cfl},
                   [](std::size_t layer, const Vec3&) { return layer == 0 ? -1.0 : 0.0; });
        CAPTURE(row.bottom, row.cfl, before - mask_volume());
        // The two lower edges, 2 long, lose at most a cell's area each. On nodes they last longer: 500 time
        // steps take little more than half of that.
        CHECK(std::abs(before - mask_volume()) < (row.bottom == 0.0 ? 0.6 * 2.0 * 2.0 : 2.0 * 2.0));
        // Etched: the window's width times the depth, and a quarter circle under either side of the mask. The
        // front may be off by a cell.
        const double etched = 2.0 * (20.0 * 40.0 + 0.5 * std::numbers::pi * 40.0 * 40.0),
                     front = 2.0 * (20.0 + std::numbers::pi * 40.0);
        CHECK(silicon_before - volume(*stack.layers[0].phi) == Approx(etched).margin(front));
    }
}

TEST_CASE("under a mask the silicon etches up to the mask and no farther") {
    // Time steps of half a cell must not etch past the mask's underside, which is then exposed.
    const Domain domain = make_domain({40.0, 2.0}, 1.0, {Side::reflective, Side::reflective});
    MaterialStack stack = under_slit_mask(domain, 0.4, 8.0, 10.6);
    test::move(stack, 8.0, {Scheme::weno3, TimeIntegration::euler, 0.5},
               [](std::size_t layer, const Vec3&) { return layer == 0 ? -1.0 : 0.0; });
    int seen = 0;
    for (const Vec3& p : extract_surface(stack.top(), domain).vertices) {
        // Only vertices away from the mask's edge and from the front.
        if (p.z() < -2.0 || p.z() > 4.0 || std::abs(p.x()) < 7.0 || std::abs(p.x()) > 10.5) continue;
        ++seen;
        CHECK(p.z() == Approx(0.4).margin(0.1));
        CHECK(exposed_material(stack, p) == 1);
    }
    CHECK(seen > 5);
}

TEST_CASE("a body that etches on faces to one side only recedes there and nowhere else") {
    const Domain domain = make_domain({40.0, 2.0}, 1.0, {Side::reflective, Side::reflective});
    Shape fin;
    fin.kind = ShapeKind::fin;
    fin.width = 12.3;
    fin.height = 12.6;
    MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, fin}});
    test::move(stack, 4.0, {},
               [](std::size_t layer, const Vec3& n) { return layer == 1 ? -std::max(0.0, -n.x()) : 0.0; },
               {0.0, 1.0});
    int seen = 0;
    for (const Vec3& p : extract_surface(stack.top(), domain).vertices) {
        if (p.z() < 4.0 || p.z() > 8.0) continue;
        ++seen;
        CHECK(p.x() == Approx(p.x() < 2.0 ? -6.15 + 4.0 : 6.15).margin(0.02));
    }
    CHECK(seen > 5);
}

TEST_CASE("shapes have the sizes they were given") {
    const Domain domain = test::unit_domain(40);
    const auto volume_below = [&](const Shape& shape) {
        return test::volume_above_zero(make_stack(domain, {{0, shape}}).top(), domain);
    };
    const double pi = std::numbers::pi, slope = std::tan(5.0 * pi / 180.0);
    // Marching cubes cuts edges and corners by a fraction of a cell: an error of O(dx) of the edge length,
    // here below 1.5 %.
    Shape s;
    s.depth = 15.2;
    s.width = 12.4;
    s.taper_deg = 5.0;
    s.kind = ShapeKind::trench;
    CHECK(volume_below(s) == Approx(-40.0 * 15.2 * (12.4 - 15.2 * slope)).epsilon(0.015));
    s.kind = ShapeKind::hole;
    s.radius = 11.3;
    const double bottom = 11.3 - 15.2 * slope;
    CHECK(volume_below(s) ==
          Approx(-pi * 15.2 / 3.0 * (11.3 * 11.3 + 11.3 * bottom + bottom * bottom)).epsilon(0.015));
    Shape f;
    f.kind = ShapeKind::fin;
    f.width = 9.6;
    f.height = 13.3;
    CHECK(volume_below(f) == Approx(40.0 * 9.6 * 13.3).epsilon(0.015));
    Shape b;
    b.kind = ShapeKind::box;
    b.size = {14.6, 17.3};
    b.height = 9.2;
    CHECK(volume_below(b) == Approx(14.6 * 17.3 * 9.2).epsilon(0.015));
}

TEST_CASE("a closed mesh file becomes the body it encloses") {
    const Domain domain = test::unit_domain(40);
    const TriangleMesh sphere = extract_surface(*test::sphere_grid(domain, 11.4), domain);
    const auto path = std::filesystem::temp_directory_path() / "sidewall_stack_test_sphere.ply";
    surface::write_mesh(path, sphere);
    Shape shape;
    shape.kind = ShapeKind::mesh;
    shape.file = path.string();
    const TriangleMesh again = extract_surface(make_stack(domain, {{0, shape}}).top(), domain);
    std::filesystem::remove(path);
    // Facets with edges of a cell lie at most 1 / (8 r) inside the sphere, twice that after two extractions.
    const auto error = test::radius_error(again, 11.4);
    CHECK(error.max < 3.0 / (8.0 * 11.4) + 0.01);
}

TEST_CASE("curvatures of a sphere are 1/r and 1/r^2, to second order") {
    double error[2];
    for (int level = 0; level < 2; ++level) {
        const double radius = 10.0 * (1 + level);
        const Domain domain = test::unit_domain(static_cast<int>(2 * radius) + 12);
        const GridPtr grid = test::sphere_grid(domain, radius);
        const TriangleMesh mesh = extract_surface(*grid, domain);
        const surface::Curvature c = curvature(*grid, domain, mesh);
        error[level] = 0;
        for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
            error[level] = std::max(error[level], std::abs(c.mean[v] * radius - 1.0));
            error[level] = std::max(error[level], std::abs(c.gaussian[v] * radius * radius - 1.0));
        }
    }
    CHECK(std::log2(error[0] / error[1]) > 1.6);
    CHECK(error[0] < 0.05);
}

TEST_CASE("a plane has no features and a mirrored trench has its edges") {
    const Domain domain = test::unit_domain(40);
    const MaterialStack plane = make_stack(domain, {{0, Shape{}}});
    const TriangleMesh flat = extract_surface(plane.top(), domain);
    for (const auto flag : surface::feature_flags(curvature(plane.top(), domain, flat), 1.0))
        REQUIRE(flag == 0);

    Shape shape;
    shape.kind = ShapeKind::trench;
    shape.width = 17.0;
    shape.depth = 20.3;
    const MaterialStack trench = make_stack(domain, {{0, shape}});
    const TriangleMesh mesh = extract_surface(trench.top(), domain);
    const auto flags = surface::feature_flags(curvature(trench.top(), domain, mesh), 1.0, 0.2);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        const Vec3& p = mesh.vertices[v];
        const double edge =
            std::hypot(std::abs(p.x()) - 8.5, std::min(std::abs(p.z()), std::abs(p.z() + 20.3)));
        CAPTURE(p.x(), p.z());
        if (edge > 3.0) CHECK(flags[v] == 0);
        if (edge < 0.3) CHECK(flags[v] == 1);
    }
}

TEST_CASE("a checkpoint restores every layer bit for bit") {
    const Domain domain = test::unit_domain(40);
    MaterialStack stack = make_stack(domain, {{3, Shape{}}, {5, mask_hole(10, 6)}});
    test::move(stack, 2.0, {}, [](std::size_t layer, const Vec3&) { return layer == 0 ? -1.0 : -0.1; });
    const auto path = std::filesystem::temp_directory_path() / "sidewall_stack_test.vdb";
    save_checkpoint(path, stack, "where we were");
    const Checkpoint loaded = load_checkpoint(path, domain);
    CHECK(loaded.text == "where we were");
    REQUIRE(loaded.stack.layers.size() == 2);
    for (std::size_t k = 0; k < 2; ++k) {
        CHECK(loaded.stack.layers[k].material == stack.layers[k].material);
        const Grid &a = *stack.layers[k].phi, &b = *loaded.stack.layers[k].phi;
        REQUIRE(a.activeVoxelCount() == b.activeVoxelCount());
        REQUIRE(a.tree().leafCount() == b.tree().leafCount());
        auto leaf_a = a.tree().cbeginLeaf();
        for (auto leaf_b = b.tree().cbeginLeaf(); leaf_b; ++leaf_a, ++leaf_b) {
            REQUIRE(leaf_a->origin() == leaf_b->origin());
            REQUIRE(leaf_a->buffer() == leaf_b->buffer());
            REQUIRE(leaf_a->getValueMask() == leaf_b->getValueMask());
        }
    }
    CHECK_THROWS_AS(load_checkpoint(path, test::unit_domain(42)), FileError);
    std::ofstream(path, std::ios::binary | std::ios::trunc) << "not a grid";
    CHECK_THROWS_AS(load_checkpoint(path, domain), FileError);
    std::filesystem::remove(path);
    CHECK_THROWS_AS(load_checkpoint(path, domain), FileError);
}

TEST_CASE("a film grows by any small part of a cell a time step, and what it grows on does not") {
    const Domain domain = test::unit_domain(40);
    MaterialStack stack = make_stack(domain, {{0, Shape{}}, {1, mask_hole(10, 6)}});
    const TriangleMesh interface_before = extract_surface(*stack.layers[1].phi, domain);
    begin_film(stack, 2);
    constexpr double kStep = 0.25 * kExposed;
    for (int n = 0; n < 200; ++n) test::move(stack, kStep, {}, [](std::size_t, const Vec3&) { return 1.0; });
    const TriangleMesh interface_after = extract_surface(*stack.layers[1].phi, domain);
    CHECK(surface::two_sided_distance(interface_after, interface_before).max < kExposed);
    for (const Vec3& p : extract_surface(stack.top(), domain).vertices)
        if (std::hypot(p.x(), p.y()) > 14) REQUIRE(p.z() == Approx(6.0 + 200 * kStep).margin(0.05));
}
