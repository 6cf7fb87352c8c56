#include "levelset/meshes/contact_lines.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "levelset/meshes/nearest_on_segments.hpp"
#include "surface/distance.hpp"
#include "surface/topology.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

constexpr double kThrough = std::numeric_limits<double>::infinity();

// A plate up to z = \p top with a slit \p width wide along y.
Shape plate(double top, double width) {
    Shape shape{.kind = ShapeKind::trench, .top = top};
    shape.width = width;
    shape.depth = kThrough;
    return shape;
}

// How far, in cells, a layer's meshes reach below \p low or above \p high where |x| >= \p x_min: the layer's
// part of the surface, and points over 0.05 cells from both its interfaces, sampled every 0.05 cells in z.
double reach(const MaterialStack& stack, const StackMeshes& meshes, std::size_t layer, double low,
             double high, double x_min = 0.0) {
    constexpr double kHalfDisc = 0.05;
    double most = 0.0;
    const auto add = [&](const Vec3& p) {
        if (std::abs(p.x()) >= x_min) most = std::max({most, low - p.z(), p.z() - high});
    };
    const CutMesh& cut = meshes.surface;
    for (std::size_t t = 0; t < cut.mesh.triangles.size(); ++t)
        if (cut.layer[t] == layer)
            for (const std::uint32_t v : cut.mesh.triangles[t]) add(cut.mesh.vertices[v]);
    const surface::SignedDistance upper(layer + 1 < stack.layers.size() ? meshes.interfaces[layer]
                                                                        : cut.mesh);
    std::optional<surface::SignedDistance> lower;
    if (layer > 0) lower.emplace(meshes.interfaces[layer - 1]);
    const auto [x_max, y_max] = stack.domain.max;
    for (double y = -0.9 * y_max; y < y_max; y += 0.37 * y_max)
        for (double x = -x_max + 0.05; x < x_max; x += 0.2)
            for (double beyond = 0.1; beyond < 1.5; beyond += 0.05)
                for (const double z : {low - beyond, high + beyond}) {
                    if (!std::isfinite(z)) continue;
                    const Vec3 p(x, y, z);
                    if (upper.at(p).distance < -kHalfDisc && (!lower || lower->at(p).distance > kHalfDisc))
                        add(p);
                }
    return most;
}

// Whether the mesh's border turns back anywhere, as where a triangle at a side is folded.
bool border_turns_back(const TriangleMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    std::map<std::uint32_t, std::uint32_t> next;
    for (const auto& [edge, count] : edges)
        if (!edges.contains({edge.second, edge.first})) next.insert(edge);
    return std::ranges::any_of(next, [&](const auto& edge) {
        const Vec3& at = mesh.vertices[edge.second];
        const Vec3 before = at - mesh.vertices[edge.first], after = mesh.vertices[next.at(edge.second)] - at;
        return before.normalized().dot(after.normalized()) < -0.8;
    });
}

void check_meshes(const StackMeshes& meshes) {
    std::vector<const TriangleMesh*> all{&meshes.surface.mesh};
    for (const TriangleMesh& mesh : meshes.interfaces) all.push_back(&mesh);
    for (const TriangleMesh* mesh : all) {
        const auto topology = surface::analyse_topology(*mesh);
        CHECK(topology.manifold());
        CHECK(topology.oriented());
        CHECK(topology.isolated_vertices == 0);
        CHECK(surface::boundary_on_rectangle(*mesh, topology));
    }
}

}  // namespace

TEST_CASE("the nearest point on a segment is found wherever it lies on it, however long the segment is") {
    const Vec3 from(0.3, -0.2, 0.1), way(9.0, 4.0, -6.0), across = Vec3(4.0, -9.0, 0.0).normalized();
    const NearestOnSegments rim({{from, from + way}}, 1.0);
    for (double share = 0.0; share <= 1.0; share += 0.01) {
        const Vec3 on = from + share * way, beside = on + 0.45 * across;
        const std::optional<Vec3> found = rim.at(beside);
        INFO(share);
        REQUIRE(found);
        CHECK((*found - on).norm() < 1e-12);
    }
}

TEST_CASE("no tooth of a mask hangs down where an undercut ends, wherever its underside lies between nodes") {
    for (const bool oblique : {false, true})
        for (const double bottom : {0.0, 0.3, 0.5, 0.8})
            for (const double etched : {2.0, 4.6}) {
                const Domain domain =
                    make_domain({28.0, oblique ? 12.0 : 2.0}, 1.0, {Side::reflective, Side::reflective});
                Shape silicon, mask = plate(bottom + 5.0, 10.2);
                silicon.top = bottom;
                if (oblique) {
                    mask = {.kind = ShapeKind::mask, .top = bottom + 5.0};
                    mask.polygons = {{{-9.2, -30.0}, {2.1, -30.0}, {9.0, 30.0}, {-2.3, 30.0}}};
                }
                MaterialStack stack = make_stack(domain, {{0, silicon}, {1, mask}});
                test::move(stack, etched, {},
                           [](std::size_t layer, const Vec3&) { return layer == 0 ? -1.0 : 0.0; });
                const StackMeshes meshes = extract_materials(stack, extract_surface(stack));
                CAPTURE(oblique, bottom, etched);
                check_meshes(meshes);
                CHECK(reach(stack, meshes, 1, bottom, bottom + 5.0) < 0.26);
                CHECK(reach(stack, meshes, 0, -kThrough, bottom) < 0.26);
            }
}

TEST_CASE(
    "where a mask stands on silicon its foot and its edges are sharp, wherever they lie between nodes") {
    for (const double bottom : {0.0, 0.13, 0.5})
        for (const double wall : {0.0, 0.13, 0.4, 0.5})
            for (const double depth : {0.0, 3.4})
                for (const bool film : {false, true}) {  // film: begun, still without thickness
                    const Domain domain = make_domain({28.0, 2.0}, 1.0, {Side::reflective, Side::periodic});
                    Shape silicon, recess = plate(bottom, 10.0 + 2.0 * wall);
                    silicon.top = bottom;
                    recess.depth = depth;
                    recess.subtract = true;
                    std::vector<std::pair<int, Shape>> bodies{{0, silicon}};
                    if (depth > 0.0) bodies.emplace_back(0, recess);
                    // The mask's window is wider than the recess, so that the silicon's edge is bare.
                    bodies.emplace_back(1, plate(bottom + 4.3, 20.0 + 2.0 * wall));
                    MaterialStack stack = make_stack(domain, bodies);
                    if (film) begin_film(stack, 2);
                    const StackMeshes meshes = extract_materials(stack, extract_surface(stack));
                    CAPTURE(bottom, wall, depth, film);
                    check_meshes(meshes);
                    double silicon_area = 0.0, mask_area = 0.0;
                    for (std::size_t t = 0; t < meshes.surface.layer.size(); ++t)
                        (meshes.surface.layer[t] == 1 ? mask_area : silicon_area) +=
                            triangle_area(meshes.surface.mesh, t);
                    const double floor = 20.0 + 2.0 * wall;
                    // Where walls or floors lie on nodes, re-distancing leaves values in corners, and so the
                    // corners, off by up to 0.065 cells.
                    const double most = 4.0 * 0.065;
                    CHECK(silicon_area == Approx(2.0 * (floor + 2.0 * depth)).margin(most));
                    CHECK(mask_area == Approx(2.0 * (28.0 - floor + 2.0 * 4.3)).margin(most));
                    CHECK(total_area(meshes.interfaces[0]) ==
                          Approx(2.0 * (28.0 + 2.0 * depth)).margin(most));
                    if (film)
                        CHECK(total_area(meshes.interfaces[1]) ==
                              Approx(silicon_area + mask_area).margin(most));
                    CHECK(meshes.surface.added.empty());  // all contact lines lie on sharp edges
                }
}

TEST_CASE("the border of an interface under a straight mask does not turn back where the undercut ends") {
    for (const double width : {11.0, 12.0, 12.4})
        for (const double etched : {5.0, 6.0, 7.3}) {
            const Domain domain = make_domain({32.0, 6.0}, 1.0, {Side::reflective, Side::reflective});
            MaterialStack stack = make_stack(domain, {{0, Shape{.top = 10.0}}, {1, plate(13.0, width)}});
            test::move(stack, etched, {},
                       [](std::size_t layer, const Vec3&) { return layer == 0 ? -1.0 : 0.0; });
            const StackMeshes meshes = extract_materials(stack, extract_surface(stack));
            CAPTURE(width, etched);
            check_meshes(meshes);
            CHECK_FALSE(border_turns_back(meshes.interfaces[0]));
        }
}

TEST_CASE("what a film covers has its edges") {
    const Domain domain = make_domain({28.0, 4.0}, 1.0, {Side::reflective, Side::reflective});
    Shape recess = plate(5.0, 12.26);
    recess.depth = 10.3;
    recess.subtract = true;
    MaterialStack stack = make_stack(domain, {{0, Shape{.top = 5.0}}, {0, recess}});
    begin_film(stack, 1);
    test::move(stack, 2.0, {}, [](std::size_t, const Vec3&) { return 1.0; });
    const StackMeshes meshes = extract_materials(stack, extract_surface(stack));
    check_meshes(meshes);
    REQUIRE(meshes.interfaces.size() == 1);
    CHECK(meshes.interfaces[0].vertices == extract_surface(stack, 0).vertices);
    // The trench's four edges are sharp; marching cubes alone would cut them off.
    CHECK(total_area(meshes.interfaces[0]) == Approx(4.0 * (28.0 + 2.0 * 10.3)).epsilon(1e-3));
    for (const std::size_t layer : meshes.surface.layer) CHECK(layer == 1);
}

TEST_CASE("every nitride that is recessed between oxides ends at their faces") {
    const Domain domain = make_domain({28.0, 2.0}, 1.0, {Side::reflective, Side::reflective});
    std::vector<std::pair<int, Shape>> bodies{{0, Shape{}}};
    std::vector<double> tops{0.0};
    for (int n = 0; n < 16; ++n) {
        tops.push_back(tops.back() + (n % 2 == 0 ? 4.3 : 3.6));
        bodies.emplace_back(n % 2, plate(tops.back(), 12.4));
    }
    MaterialStack stack = make_stack(domain, bodies);
    // The odd layers are nitride.
    test::move(stack, 4.0, {}, [](std::size_t layer, const Vec3&) { return layer % 2 == 1 ? -1.0 : 0.0; });
    const StackMeshes meshes = extract_materials(stack, extract_surface(stack));
    check_meshes(meshes);
    // Only beyond |x| = 7.5: on the oxides' outer edges, at 6.2, the etch leaves up to 0.3 cells of nitride.
    for (std::size_t k = 1; k < tops.size(); ++k) {
        CAPTURE(k);
        CHECK(reach(stack, meshes, k, tops[k - 1], tops[k], 7.5) < 0.31);
    }
}

TEST_CASE(
    "no tooth of the upper material hangs on a flush wall, wherever wall and interface lie between nodes",
    "[slow]") {
    // A recess through oxide and nitride into silicon, cut out or also etched down by a few cells: its wall
    // is flush across the layers.
    for (const ShapeKind kind : {ShapeKind::trench, ShapeKind::hole, ShapeKind::mask})
        for (const double wall : {0.0, 0.25, 0.5, 0.75})
            for (const double height : {0.0, 0.25, 0.5, 0.75})
                for (const double etched : {0.0, 2.3}) {
                    // Round and oblique walls cross all positions between nodes.
                    if (kind != ShapeKind::trench && wall > 0.0) continue;
                    const bool strip = kind == ShapeKind::trench;
                    const Domain domain =
                        make_domain({22.0, strip ? 2.0 : 22.0}, 1.0, {Side::reflective, Side::reflective});
                    Shape oxide, nitride, recess{.kind = kind};
                    oxide.top = height;
                    nitride.top = recess.top = height + 6.0 + 0.25;
                    recess.subtract = true;
                    recess.width = 10.0 + 2.0 * wall;
                    recess.radius = 6.37;
                    recess.polygons = {{{-6.2, -40.0}, {2.1, -40.0}, {6.0, 40.0}, {-2.3, 40.0}}};
                    recess.depth = 14.6;  // 3.3 into the silicon

                    MaterialStack stack = make_stack(
                        domain, {{0, Shape{.top = -5.0 + height}}, {1, oxide}, {2, nitride}, {0, recess}});
                    test::move(stack, etched, {Scheme::weno3, TimeIntegration::euler, 0.5},
                               [](std::size_t layer, const Vec3& n) {
                                   return layer == 0 ? -std::max(0.0, n.z()) : 0.0;
                               },
                               {1.0, 0.0, 0.0});
                    const StackMeshes meshes = extract_materials(stack, extract_surface(stack));
                    CAPTURE(static_cast<int>(kind), wall, height, etched);
                    check_meshes(meshes);
                    CHECK(reach(stack, meshes, 1, height - 5.0, height) < 0.3);
                    CHECK(reach(stack, meshes, 2, height, height + 6.25) < 0.3);
                }
}
