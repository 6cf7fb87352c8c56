#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "simplify/simplify.hpp"
#include "tests/flux/extracted.hpp"
#include "tests/flux/flux_checks.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/placed.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/truth.hpp"

// Surfaces extracted by marching cubes, raw and simplified, placed in several ways, against exact fluxes.

using namespace sidewall;
using namespace sidewall::flux;

namespace {

constexpr double kDepth = 2.0;  // of the trench

// A round hole whose axis lies off the box's centre.
TriangleMesh raw_hole(int depth) {
    constexpr double kCell = 1.0 / 16.0;
    return extract({-18, -20}, {38, 37}, -16 * depth - 3, 2, kCell, sharp_hole(depth, kCell));
}

// The raw mesh, or a simplified one with less than 0.7 of its vertices.
TriangleMesh simplified(const TriangleMesh& raw, simplify::Method method) {
    if (method == simplify::Method::none) return raw;
    const Box3 bounds = bounding_box(raw);
    std::vector<std::uint8_t> fixed;  // on the sides, because periodic sides must match
    for (const Vec3& p : raw.vertices)
        fixed.push_back((p.array() == bounds.min.array()).head<2>().any() ||
                        (p.array() == bounds.max.array()).head<2>().any());
    const Wedges corners = make_wedges(raw);
    std::vector<std::uint8_t> features;
    for (std::size_t v = 0; v < raw.vertices.size(); ++v)
        features.push_back(corners.first[v + 1] - corners.first[v] > 1);
    simplify::Options options;
    options.method = method;
    options.fixed = fixed;
    if (method == simplify::Method::lindstrom_turk) options.target_vertices = 6 * raw.vertices.size() / 10;
    TriangleMesh mesh = simplify::simplify(raw, features, options).mesh;
    REQUIRE(10 * mesh.vertices.size() < 7 * raw.vertices.size());
    return mesh;
}

std::vector<Placed> placements(const TriangleMesh& mesh, double plane_x, double plane_y) {
    return {{"as extracted", mesh, [](const Vec3& p) { return p; }},
            placed_mirrored(mesh),
            placed_turned(mesh),
            placed_shifted(mesh, plane_x, plane_y, Vec3::Zero())};
}

simplify::Method any_method() {
    return GENERATE(simplify::Method::none, simplify::Method::lindstrom_turk, simplify::Method::region,
                    simplify::Method::region_bounded);
}

bool is_wall(const TriangleMesh& mesh, std::size_t t) {
    return std::abs(area_vector(mesh, t).normalized().z()) < 0.7;
}

}  // namespace

TEST_CASE("an extracted trench, raw or simplified, has the exact radiosity's flux wherever it is placed",
          "[slow]") {
    const auto method = any_method();
    const TriangleMesh mesh = simplified(extracted_trench(kDepth), method);
    Comparison comparison;
    std::uint32_t stream = 0;
    for (const double sticking : {1.0, 0.1}) {
        const TrenchFlux exact = trench_flux(kDepth, sticking, 400, 100);
        for (const Placed& placed : placements(mesh, 0.27, 0.33)) {
            // Five groups down the walls, three from the walls to the middle of the floor, then all of each.
            Groups groups(10);
            for (std::size_t t = 0; t < placed.mesh.triangles.size(); ++t) {
                const Vec3 c = placed.back(triangle_centroid(placed.mesh, t));
                if (is_wall(placed.mesh, t)) {
                    groups[static_cast<std::size_t>(std::clamp(-c.z() / kDepth, 0.0, 0.999) * 5.0)].push_back(
                        t);
                    groups[8].push_back(t);
                } else if (c.z() < -0.5 * kDepth) {
                    groups[5 + static_cast<std::size_t>(std::clamp(0.5 - std::abs(c.x()), 0.0, 0.499) * 6.0)]
                        .push_back(t);
                    groups[9].push_back(t);
                }
            }
            std::erase_if(groups, [](const auto& group) { return group.empty(); });
            CHECK(groups.size() >= 7);
            const auto means = over_seeds(placed.mesh, kPeriodic, {"test", 1.0, {sticking}},
                                          sticking == 1.0 ? 5'000'000 : 1'500'000, stream++, groups);
            for (std::size_t g = 0; g < groups.size(); ++g) {
                CAPTURE(simplify::to_string(method), sticking, placed.how, g);
                const bool wall = is_wall(placed.mesh, groups[g][0]);
                comparison.check(means[g], mean_over(placed.mesh, groups[g], [&](const Vec3& p) {
                                     return wall ? at_position(exact.wall, -p.z() / kDepth)
                                                 : at_position(exact.floor, placed.back(p).x() + 0.5);
                                 }));
            }
        }
    }
    comparison.verdict();
}

TEST_CASE(
    "an extracted hole, raw or simplified, transmits what Clausing computed and its floor sees the opening",
    "[slow]") {
    const auto method = any_method();
    const int length = GENERATE(1, 4);
    const TriangleMesh mesh = simplified(raw_hole(length), method);
    Comparison comparison;
    std::uint32_t stream = 0;
    for (const Placed& placed : placements(mesh, 0.3, -0.4)) {
        const LateralBox box = lateral_box(placed.mesh, kPeriodic);
        Groups groups(3), floor(1);  // rings of the floor, and all of it
        std::vector<std::int32_t> materials;
        double plate = 0.0, depth = 0.0;
        for (std::size_t t = 0; t < placed.mesh.triangles.size(); ++t) {
            const Vec3 c = triangle_centroid(placed.mesh, t);
            const bool wall = is_wall(placed.mesh, t), deep = c.z() < -0.5 * length;
            materials.push_back(wall ? 1 : 0);
            if (wall) continue;
            if (!deep) {
                plate += 0.5 * area_vector(placed.mesh, t).z();
                continue;
            }
            depth = std::max(depth, -c.z());
            floor[0].push_back(t);
            const double r = placed.back(c).head<2>().norm();
            groups[r < 0.4 ? 0 : r < 0.7 ? 1 : 2].push_back(t);
        }
        // The circle with the area of the faceted hole.
        const double area = box.area() - plate, radius = std::sqrt(area / 3.14159265358979);
        CAPTURE(simplify::to_string(method), length, placed.how, radius);
        CHECK(std::abs(radius - 1.0) < 0.002);
        const Mean all = over_seeds(placed.mesh, kPeriodic, {"test", 1.0, {1.0, 0.0}}, 1'000'000, stream++,
                                    floor, materials)[0];
        double floor_area = 0.0;
        for (const std::size_t t : floor[0]) floor_area += triangle_area(placed.mesh, t);
        comparison.check({all.flux * floor_area / area, all.error * floor_area / area},
                         clausing_transmission(depth / radius));
        if (length > 1) continue;  // the deep floor's view factors: reference_test.cpp
        const auto means =
            over_seeds(placed.mesh, kPeriodic, {"test", 1.0, {1.0}}, 2'500'000, stream++, groups);
        for (std::size_t g = 0; g < groups.size(); ++g) {
            CAPTURE(g);
            comparison.check(means[g], mean_over(placed.mesh, groups[g], [&](const Vec3& p) {
                                 return disk_view(depth / radius, placed.back(p).head<2>().norm() / radius);
                             }));
        }
    }
    comparison.verdict();
}
