#include "simplify/simplify.hpp"

#include "checks.hpp"
#include "surface/distance.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::test;
using simplify::kShapeWeights;
using simplify::kVolumeWeights;
using simplify::simplify_lindstrom_turk;

namespace {

std::size_t share(const TriangleMesh& mesh, double kept) {
    return std::size_t(kept * double(mesh.vertices.size()));
}

}  // namespace

TEST_CASE("Lindstrom-Turk keeps the volume of a smooth closed surface") {
    // A polyhedron inscribed in a sphere of radius r with edges h lacks a share of order (h / r)^2 of the
    // volume. The collapse has the volume as its first constraint, so its own change must be far below this.
    const double radius = 1.0;
    const TriangleMesh mesh = sphere_mesh(radius, 30);
    const double before = enclosed_volume(mesh);
    for (const double kept : {0.5, 0.2, 0.1}) {
        const TriangleMesh coarse =
            simplify_lindstrom_turk(mesh, {.target_vertices = share(mesh, kept)}).mesh;
        // Mean edge of an equilateral triangulation of the sphere: area 4 pi r^2 = 2 n sqrt(3)/4 h^2.
        const double h2 = 8.0 * M_PI * radius * radius / (std::sqrt(3.0) * double(coarse.vertices.size()));
        CHECK(std::abs(enclosed_volume(coarse) / before - 1.0) < 0.02 * h2 / (radius * radius));
        require_same_kind(mesh, coarse);
    }
}

TEST_CASE("a coarse sphere stays within the sagitta of its edges") {
    const TriangleMesh mesh = sphere_mesh(1.0, 30);
    const TriangleMesh coarse = simplify_lindstrom_turk(mesh, {.target_vertices = share(mesh, 0.1)}).mesh;
    double longest = 0.0;
    for (const Triangle& t : coarse.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            longest = std::max(longest, (coarse.vertices[t[k]] - coarse.vertices[t[(k + 1) % 3]]).norm());
    // Triangles with edges up to h lie within h^2 / 6 of the unit sphere through their corners: their
    // circumradius is at most h / sqrt 3.
    CHECK(surface::two_sided_distance(mesh, coarse).max < longest * longest / 6.0);
}

TEST_CASE("genus survives") {
    const TriangleMesh mesh = torus_mesh(1.0, 0.4, 36);
    REQUIRE(surface::analyse_topology(mesh).euler() == 0);
    const TriangleMesh coarse = simplify_lindstrom_turk(mesh, {}).mesh;
    require_same_kind(mesh, coarse);
    CHECK(coarse.vertices.size() < mesh.vertices.size() / 10);
}

TEST_CASE("the boundary stays in its side planes to the last bit and its corners stay put") {
    for (const auto& weights : {kVolumeWeights, kShapeWeights})
        for (const double roughness : {0.0, 0.1}) {
            const TriangleMesh mesh = trench_mesh(0.4, roughness);
            REQUIRE(surface::boundary_on_rectangle(mesh, surface::analyse_topology(mesh)));
            const Box3 box = bounding_box(mesh);
            const TriangleMesh coarse =
                simplify_lindstrom_turk(mesh, {.target_vertices = share(mesh, 0.1), .weights = weights}).mesh;
            const surface::Topology topology = surface::analyse_topology(coarse);
            REQUIRE(surface::boundary_on_rectangle(coarse, topology));
            require_same_kind(mesh, coarse);
            for (int axis : {0, 1}) {
                CHECK(bounding_box(coarse).min[axis] == box.min[axis]);
                CHECK(bounding_box(coarse).max[axis] == box.max[axis]);
            }
            const Places left = places(coarse);
            for (const Vec3& p : mesh.vertices)
                if ((p.x() == box.min.x() || p.x() == box.max.x()) &&
                    (p.y() == box.min.y() || p.y() == box.max.y()))
                    CHECK(left.contains(p));
        }
}

TEST_CASE("side planes are kept to the last bit far from the origin") {
    TriangleMesh mesh = trench_mesh(0.5);
    const Vec3 away(1e5 + 0.1, -3e5 - 0.7, 0.3);
    for (Vec3& p : mesh.vertices) p += away;
    const TriangleMesh coarse = simplify_lindstrom_turk(mesh, {.target_vertices = share(mesh, 0.1)}).mesh;
    CHECK(surface::boundary_on_rectangle(coarse, surface::analyse_topology(coarse)));
    CHECK(coarse.vertices.size() <= share(mesh, 0.1));
}

TEST_CASE("no triangle is flipped or made degenerate") {
    for (const auto& weights : {kVolumeWeights, kShapeWeights})
        for (const double kept : {0.5, 0.3, 0.1}) {
            const Field field = trench_field();
            const TriangleMesh mesh = trench_mesh(0.25);
            REQUIRE(flipped(mesh, field) == 0);
            const TriangleMesh coarse =
                simplify_lindstrom_turk(mesh, {.target_vertices = share(mesh, kept), .weights = weights})
                    .mesh;
            CHECK(flipped(coarse, field) == 0);
            require_same_kind(mesh, coarse);
        }
}

TEST_CASE("a flat square keeps its area and goes down to its corners") {
    const TriangleMesh mesh = square_mesh(12, 0.1);
    const TriangleMesh coarse = simplify_lindstrom_turk(mesh, {}).mesh;
    CHECK(coarse.triangles.size() == 2);
    CHECK(total_area(coarse) == Approx(total_area(mesh)).epsilon(1e-12));
    for (const Vec3& p : coarse.vertices) CHECK(p.z() == 0.0);
}

TEST_CASE("the target is met to the vertex where the surface allows") {
    const TriangleMesh mesh = trench_mesh(0.4);
    for (const double kept : {0.9, 0.5, 0.1})
        CHECK(simplify_lindstrom_turk(mesh, {.target_vertices = share(mesh, kept)}).mesh.vertices.size() ==
              share(mesh, kept));
}

TEST_CASE("no edge of the bound's length or longer collapses") {
    // On a square grid the sides are shorter than 1.2 cells, the diagonals are not. No edge is shorter than
    // one cell.
    const TriangleMesh mesh = square_mesh(10, 1.0);
    CHECK(same_bits(simplify_lindstrom_turk(mesh, {.l_max = 1.0}).mesh, mesh));
    CHECK(simplify_lindstrom_turk(mesh, {.l_max = 1.2}).passes.at(0).removed > 0);
}

TEST_CASE("materials keep their border and their triangles") {
    TriangleMesh mesh = square_mesh(16, 0.25);
    Attribute material{"material", 1, Scalar::int32, {}};
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        material.values.push_back(
            triangle_centroid(mesh, t).x() + 0.3 * triangle_centroid(mesh, t).y() < 2.5 ? 1 : 7);
    mesh.triangle_attributes = {material, {"flux", 1, Scalar::float64, material.values}};
    const auto area = [](const TriangleMesh& m, double id) {
        double sum = 0.0;
        for (std::size_t t = 0; t < m.triangles.size(); ++t)
            if (m.triangle_attribute("material")->values[t] == id) sum += triangle_area(m, t);
        return sum;
    };
    const TriangleMesh coarse = simplify_lindstrom_turk(mesh, {}).mesh;
    REQUIRE(coarse.triangle_attributes.size() == 1);
    CHECK(coarse.vertices.size() < mesh.vertices.size() / 3);
    for (const double id : {1.0, 7.0}) CHECK(area(coarse, id) == Approx(area(mesh, id)).epsilon(1e-12));
}

TEST_CASE("the smallest meshes come back whole") {
    TriangleMesh triangle;
    triangle.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
    triangle.triangles = {{0, 1, 2}};
    CHECK(same_bits(simplify_lindstrom_turk(triangle, {}).mesh, triangle));
    CHECK(simplify_lindstrom_turk({}, {}).mesh.vertices.empty());

    TriangleMesh tetrahedron = triangle;
    tetrahedron.vertices.emplace_back(0, 0, 1);
    tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    CHECK(same_bits(simplify_lindstrom_turk(tetrahedron, {}).mesh, tetrahedron));

    TriangleMesh fan;
    fan.vertices.emplace_back(0, 0, 0);
    for (int i = 0; i <= 6; ++i) fan.vertices.emplace_back(std::cos(0.4 * i), std::sin(0.4 * i), 0.0);
    for (std::uint32_t i = 1; i <= 6; ++i) fan.triangles.push_back({0, i, i + 1});
    require_same_kind(fan, simplify_lindstrom_turk(fan, {}).mesh);
}

TEST_CASE("unused vertices go, coincident ones merge without crossing the target") {
    TriangleMesh mesh = square_mesh(4, 1.0);
    mesh.vertices.emplace_back(9, 9, 9);
    const auto coarse = simplify_lindstrom_turk(mesh, {.l_max = 0.0}).mesh;
    CHECK(coarse.vertices.size() == 25);

    mesh = square_mesh(6, 1.0);
    mesh.vertices[24] = mesh.vertices[25];  // two inner neighbours coincide: two triangles have no area
    const std::size_t n = mesh.vertices.size();
    CHECK(simplify_lindstrom_turk(mesh, {.target_vertices = n}).mesh.vertices.size() == n);
    CHECK(simplify_lindstrom_turk(mesh, {.l_max = 0.5}).mesh.vertices.size() == n - 1);
    require_same_kind(mesh, simplify_lindstrom_turk(mesh, {}).mesh);
}
