#include "app/process/arriving/surface_field.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/common/json.hpp"
#include "tests/surface/surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

// A sheet of n x n cells over [0, 1]^2 at height z, bent upwards by 90 degrees at x = 1/2 if asked.
TriangleMesh sheet(std::uint32_t n, double z, bool bent = false) {
    return test::grid_mesh(n, n, [=](double x, double y) {
        const double rise = bent && x > 0.5 ? x - 0.5 : 0.0;
        return Vec3(rise > 0.0 ? 0.5 : x, y, z + rise);
    });
}

}  // namespace

TEST_CASE("a linear coverage is carried exactly to another mesh of the plane") {
    const TriangleMesh from = sheet(4, 0.0), to = sheet(7, 0.001);
    const flux::Wedges wedges = flux::make_wedges(from), other = flux::make_wedges(to);
    std::vector<double> values;
    for (const Vec3& p : from.vertices) values.push_back(0.1 + 0.5 * p.x() + 0.2 * p.y());
    REQUIRE(wedges.count() == from.vertices.size());
    const SurfaceField field = surface_field(from, wedges, {"etchant"}, {values});
    const auto carried = carry(field, {"new", "etchant"}, to, other, {});
    REQUIRE(carried.size() == 2);
    double worst = 0.0;
    for (std::size_t v = 0; v < to.vertices.size(); ++v) {
        CHECK(carried[0][v] == 0.0);  // an unknown coverage begins at 0
        const Vec3& p = to.vertices[v];
        worst = std::max(worst, std::abs(carried[1][v] - (0.1 + 0.5 * p.x() + 0.2 * p.y())));
    }
    CHECK(worst < 0.7 * 0.1 / 7.0);  // read a tenth of the distance to the fan's middle, at the rim
}

TEST_CASE("a coverage that jumps at an edge is carried to either side of it") {
    const TriangleMesh from = sheet(4, 0.0, true), to = sheet(6, 0.0, true);
    const flux::Wedges wedges = flux::make_wedges(from), other = flux::make_wedges(to);
    std::vector<double> values(wedges.count());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        values[wedges.corner[c]] = area_vector(from, c / 3).normalized().z() > 0.5 ? 1.0 : 0.25;
    const auto carried = carry(surface_field(from, wedges, {"theta"}, {values}), {"theta"}, to, other, {});
    for (std::size_t c = 0; c < other.corner.size(); ++c)
        CHECK(carried[0][other.corner[c]] ==
              Approx(area_vector(to, c / 3).normalized().z() > 0.5 ? 1.0 : 0.25).epsilon(1e-12));
}

TEST_CASE("a coverage is carried across a periodic side, and not across a mirrored one") {
    // A wall faces x = 0 at a distance of 0.95: beyond the periodic side it is 0.05 away.
    const TriangleMesh wall = test::grid_mesh(1, 4, [](double x, double y) { return Vec3(0.95, y, x); }),
                       floor =
                           test::grid_mesh(1, 4, [](double x, double y) { return Vec3(0.4 * x, y, 0.0); }),
                       from = test::joined({floor, wall});
    const flux::Wedges wedges = flux::make_wedges(from);
    std::vector<double> values(wedges.count());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        values[wedges.corner[c]] = c / 3 < floor.triangles.size() ? 0.25 : 1.0;
    const SurfaceField field = surface_field(from, wedges, {"theta"}, {values});
    const Vec3 point(0.0, 0.5, 0.5);
    using flux::Boundary;
    for (const Boundary side : {Boundary::periodic, Boundary::reflective}) {
        flux::LateralBox box{{0.0, 0.0}, {1.0, 1.0}, {side, Boundary::reflective}};
        box.period[0] = side == Boundary::periodic ? 1.0 : 0.0;
        const double carried = carry(field, {"theta"}, std::span(&point, 1), box)[0][0];
        CHECK(carried == (side == Boundary::periodic ? 1.0 : 0.25));
    }
}

TEST_CASE("a checkpoint gives coverages back bit for bit, and refuses damaged ones") {
    const TriangleMesh mesh = sheet(3, 1.0 / 3.0);
    const flux::Wedges wedges = flux::make_wedges(mesh);
    std::vector<double> values(wedges.count());
    for (std::size_t w = 0; w < values.size(); ++w) values[w] = std::sqrt(static_cast<double>(w)) / 7.0;
    const SurfaceField field = surface_field(mesh, wedges, {"a"}, {values});
    const SurfaceField back = surface_field_from_json(Json::from_cbor(Json::to_cbor(to_json(field))));
    CHECK(back.names == field.names);
    CHECK(back.corner == field.corner);
    REQUIRE(back.scene);
    CHECK(std::ranges::equal(back.scene->triangles(), mesh.triangles));
    CHECK(std::ranges::equal(back.scene->vertices(), mesh.vertices));
    Json strange = to_json(field);
    strange["triangles"].get_binary()[1] = 0xff;  // the index of no vertex
    CHECK_THROWS(surface_field_from_json(strange));
    strange = to_json(field);
    for (std::size_t byte = 0; byte < 8; ++byte)
        strange["vertices"].get_binary()[byte] = 0xff;  // not a number
    CHECK_THROWS(surface_field_from_json(strange));
    SurfaceField bad = field;
    bad.corner[0].pop_back();
    CHECK_THROWS(surface_field_from_json(to_json(bad)));
    CHECK_FALSE(surface_field_from_json(to_json(SurfaceField{})).scene);
}
