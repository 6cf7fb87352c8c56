#include "simplify/simplify.hpp"

#include <tbb/global_control.h>

#include <map>

#include "checks.hpp"
#include "surface/curvature.hpp"
#include "surface/error.hpp"

using namespace sidewall;
using namespace sidewall::test;
using simplify::Options;
using simplify::simplify_regions;

namespace {

constexpr double kSpacing = 0.25;

struct Case {
    TriangleMesh mesh;
    std::vector<std::uint8_t> features;
};

/// A trench with its rounded corners, of radius 3 cells, flagged as features.
Case trench_case(double roughness = 0.0) {
    Case c;
    c.mesh = trench_mesh(kSpacing, roughness);
    c.features = surface::feature_flags(c.mesh, kSpacing, 0.1);
    return c;
}

Places feature_places(const Case& c) {
    Places result;
    for (std::size_t v = 0; v < c.features.size(); ++v)
        if (c.features[v]) result.insert(c.mesh.vertices[v]);
    return result;
}

}  // namespace

TEST_CASE("l0 = 0 leaves every feature vertex where it was, bit for bit") {
    for (const double roughness : {0.0, 0.05}) {
        const Case c = trench_case(roughness);
        const Places features = feature_places(c);
        REQUIRE(features.size() > 500);
        for (const std::optional<std::size_t> target :
             {std::optional<std::size_t>{}, std::optional<std::size_t>{1}}) {
            const Options options{
                .l0 = 0.0, .step = kSpacing, .l_max = 4 * kSpacing, .target_vertices = target};
            const TriangleMesh coarse = simplify_regions(c.mesh, c.features, options).mesh;
            REQUIRE(coarse.vertices.size() < c.mesh.vertices.size());
            const Places left = places(coarse);
            std::size_t lost = 0;
            for (const Vec3& p : features) lost += !left.contains(p);
            CHECK(lost == 0);
            require_same_kind(c.mesh, coarse);
        }
    }
}

TEST_CASE("a feature everywhere and l0 = 0 changes nothing") {
    const TriangleMesh mesh = sphere_mesh(1.0, 12);
    const std::vector<std::uint8_t> all(mesh.vertices.size(), 1);
    CHECK(same_bits(simplify_regions(mesh, all, {.l0 = 0.0, .step = 0.1, .l_max = 1.0}).mesh, mesh));
}

TEST_CASE("70 % removal flips no triangle, makes none degenerate and keeps the boundary in its planes") {
    const Case c = trench_case();
    const Field field = trench_field();
    REQUIRE(flipped(c.mesh, field) == 0);
    for (const double l0 : {0.0, kSpacing, 2 * kSpacing}) {
        const std::size_t target = c.mesh.vertices.size() * 3 / 10;
        const TriangleMesh coarse =
            simplify_regions(c.mesh, c.features,
                             {.l0 = l0, .step = kSpacing, .l_max = 0, .target_vertices = target})
                .mesh;
        if (l0 > 0.0) CHECK(coarse.vertices.size() == target);
        CHECK(coarse.vertices.size() >= target);
        CHECK(flipped(coarse, field) == 0);
        CHECK(surface::boundary_on_rectangle(coarse, surface::analyse_topology(coarse)));
        require_same_kind(c.mesh, coarse);
    }
}

TEST_CASE("edges grow with the number of rings from the features") {
    // A flat square whose left side is the feature.
    const TriangleMesh mesh = square_mesh(80, 1.0);
    std::vector<std::uint8_t> features(mesh.vertices.size(), 0);
    for (std::size_t v = 0; v < features.size(); ++v) features[v] = mesh.vertices[v].x() <= 2.0;
    const auto result = simplify_regions(mesh, features, {.l0 = 0.0, .step = 2.0, .l_max = 10.0});
    const TriangleMesh& coarse = result.mesh;
    // Mean edge length in bands of x: shortest at the features, then longer from ring to ring.
    std::map<int, std::pair<double, int>> bins;
    for (const Triangle& t : coarse.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 &a = coarse.vertices[t[k]], &b = coarse.vertices[t[(k + 1) % 3]];
            const double x = 0.5 * (a.x() + b.x());
            auto& [sum, count] = bins[x < 2.0 ? 0 : x < 8.0 ? 1 : x < 20.0 ? 2 : 3];
            sum += (a - b).norm();
            ++count;
        }
    REQUIRE(bins.size() == 4);
    for (int i = 1; i < 4; ++i)
        CHECK(bins[i].first / bins[i].second > bins[i - 1].first / bins[i - 1].second);
}

TEST_CASE("each pass allows one growth more, no more than l_max, and counts what it removed") {
    const Case c = trench_case();
    const Options options{.l0 = kSpacing, .step = 0.5 * kSpacing, .l_max = 2.2 * kSpacing};
    const auto result = simplify_regions(c.mesh, c.features, options);
    REQUIRE(result.passes.size() == 4);
    CHECK(result.passes[0].length == options.l0);
    CHECK(result.passes[1].length == Approx(1.5 * kSpacing));
    CHECK(result.passes[2].length == Approx(2.0 * kSpacing));
    CHECK(result.passes[3].length == options.l_max);
    std::size_t removed = 0;
    for (const auto& pass : result.passes) removed += pass.removed;
    CHECK(removed == c.mesh.vertices.size() - result.mesh.vertices.size());
}

TEST_CASE("no edge of l_max or longer collapses") {
    const TriangleMesh mesh = square_mesh(10, 1.0);
    const std::vector<std::uint8_t> none(mesh.vertices.size(), 0);
    CHECK(same_bits(simplify_regions(mesh, none, {.l0 = 5.0, .step = 1.0, .l_max = 1.0}).mesh, mesh));
    CHECK(same_bits(simplify_regions(mesh, none, {.l0 = 0.0, .step = 1.0, .l_max = 1.0}).mesh, mesh));
}

TEST_CASE("a target is met to the vertex, whatever l_max") {
    const Case c = trench_case();
    for (const double kept : {0.8, 0.5, 0.1}) {
        const auto target = std::size_t(kept * double(c.mesh.vertices.size()));
        const Options options{
            .l0 = kSpacing, .step = kSpacing, .l_max = 1.5 * kSpacing, .target_vertices = target};
        CHECK(simplify_regions(c.mesh, c.features, options).mesh.vertices.size() == target);
    }
}

TEST_CASE("schedules end even where the growth is small and targets out of reach") {
    const TriangleMesh mesh = square_mesh(10, 1.0);
    std::vector<std::uint8_t> features(mesh.vertices.size(), 0);
    CHECK(simplify_regions(mesh, features, {.l0 = 0.0, .step = 0.01, .l_max = 3.0}).mesh.vertices.size() <
          121);
    CHECK_THROWS_AS(simplify_regions(mesh, features, {.l0 = 0.0, .step = 1e-9, .l_max = 3.0}), RecipeError);
    features[60] = 1;
    const auto result =
        simplify_regions(mesh, features, {.l0 = 0.0, .step = 0.5, .l_max = 1.0, .target_vertices = 1});
    // Four corners and the feature stay.
    CHECK(result.mesh.vertices.size() >= 5);
    CHECK(result.mesh.vertices.size() < 121);
}

TEST_CASE("the same mesh gives the same bits, on any number of threads") {
    const Case c = trench_case(0.05);
    const Options options{.l0 = kSpacing, .step = kSpacing, .l_max = 3 * kSpacing};
    const TriangleMesh first = simplify_regions(c.mesh, c.features, options).mesh;
    CHECK(same_bits(first, simplify_regions(c.mesh, c.features, options).mesh));
    for (const std::size_t threads : {1, 2}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        CHECK(same_bits(first, simplify_regions(c.mesh, c.features, options).mesh));
    }
}
