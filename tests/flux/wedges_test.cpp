#include "flux/wedges.hpp"

#include <catch2/catch.hpp>
#include <numeric>
#include <set>

#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

double total(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
}

// Checks that every wedge is used, belongs to its corner's vertex, and that areas add up to the surface's.
void check_consistent(const TriangleMesh& mesh, const Wedges& wedges) {
    REQUIRE(wedges.corner.size() == 3 * mesh.triangles.size());
    REQUIRE(wedges.first.size() == mesh.vertices.size() + 1);
    REQUIRE(wedges.first.back() == wedges.count());
    std::set<std::uint32_t> used;
    for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
        const std::uint32_t vertex = mesh.triangles[c / 3][c % 3];
        CHECK(wedges.corner[c] >= wedges.first[vertex]);
        CHECK(wedges.corner[c] < wedges.first[vertex + 1]);
        used.insert(wedges.corner[c]);
    }
    CHECK(used.size() == wedges.count());
    CHECK(total(wedges.area) == Approx(total_area(mesh)));
}

}  // namespace

TEST_CASE("a smooth surface has one wedge a vertex") {
    const auto mesh = height_field(8, 8, 4.0, 4.0, [](auto i, auto j) {
        return 0.1 * std::sin(0.7 * static_cast<double>(i)) + 0.1 * std::cos(0.9 * static_cast<double>(j));
    });
    const Wedges wedges = make_wedges(mesh);
    check_consistent(mesh, wedges);
    CHECK(wedges.count() == mesh.vertices.size());
}

TEST_CASE("a crease splits the vertices on it, and only those") {
    // Ledge, wall, floor, wall, ledge with four creases of 90 degrees, three vertices long each.
    const auto mesh = extrude(trench_profile(2.0, 1.0, {0.5}, {0.5}), 1.0, 2);
    const Wedges wedges = make_wedges(mesh);
    check_consistent(mesh, wedges);
    CHECK(wedges.count() == mesh.vertices.size() + 4 * 3);
    SECTION("a crease angle above 90 degrees joins them") {
        CHECK(make_wedges(mesh, {}, 1.6).count() == mesh.vertices.size());
    }
}

TEST_CASE("a material edge splits the vertices on it") {
    const auto mesh = height_field(4, 4, 1.0, 1.0, [](auto, auto) { return 0.0; });
    std::vector<std::int32_t> materials;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        materials.push_back(triangle_centroid(mesh, t).x() < 0.5 ? 3 : 8);
    const Wedges wedges = make_wedges(mesh, materials);
    check_consistent(mesh, wedges);
    CHECK(wedges.count() == mesh.vertices.size() + 5);
}

TEST_CASE("fans that touch in a vertex only are different wedges") {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 3, 4}};
    CHECK(make_wedges(mesh).count() == 6);
}

TEST_CASE("triangles without area join their neighbours, and unused vertices have no wedge") {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}, {0, 1, 0}, {9, 9, 9}};
    mesh.triangles = {{0, 1, 3}, {1, 0, 2}};
    const Wedges wedges = make_wedges(mesh);
    check_consistent(mesh, wedges);
    CHECK(wedges.count() == 4);
}

TEST_CASE("interpolation of a linear function is exact, one-sided across a crease") {
    const auto mesh = extrude(trench_profile(2.0, 1.0, {0.5}, {0.5}), 1.0, 2);
    const Wedges wedges = make_wedges(mesh);
    // z + 10 on walls, x elsewhere: discontinuous over the creases.
    const auto normals = triangle_normals(mesh);
    const auto value = [&](std::size_t t, const Vec3& p) {
        return std::abs(normals[t].x()) > 0.5 ? p.z() + 10 : p.x();
    };
    std::vector<double> values(wedges.count());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        values[wedges.corner[c]] = value(c / 3, mesh.vertices[mesh.triangles[c / 3][c % 3]]);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        const Vec3 p = 0.5 * mesh.vertices[a] + 0.2 * mesh.vertices[b] + 0.3 * mesh.vertices[c];
        CHECK(interpolate(wedges, values, t, 0.2, 0.3) == Approx(value(t, p)));
    }
}

TEST_CASE("materials that do not fit the mesh are refused") {
    const auto mesh = height_field(2, 2, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const std::vector<std::int32_t> materials(3, 0);
    CHECK_THROWS_AS(make_wedges(mesh, materials), GeometryError);
}
