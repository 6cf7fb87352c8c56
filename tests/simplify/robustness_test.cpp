// What every simplification must keep, on meshes that make it hard.
#include <tbb/global_control.h>

#include <ctime>
#include <random>

#include "checks.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "tests/surface/surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::test;
using simplify::Method;

namespace {

constexpr Method kMethods[] = {Method::lindstrom_turk, Method::region, Method::region_bounded};

std::vector<std::uint8_t> features_of(const TriangleMesh& mesh, double spacing) {
    return surface::feature_flags(mesh, spacing, 0.2);
}

void require_inside(const Box3& box, const TriangleMesh& mesh) {
    for (const Vec3& p : mesh.vertices) REQUIRE((p.cwiseMax(box.min).cwiseMin(box.max) - p).isZero(0.0));
}

/// Checks all that is promised of any result: topology and bounding box.
void require_sound(const TriangleMesh& before, const TriangleMesh& after) {
    require_same_kind(before, after);
    require_inside(bounding_box(before), after);
}

void simplify_all(const TriangleMesh& mesh, const std::vector<std::uint8_t>& features, double spacing) {
    for (const Method method : kMethods)
        for (const double kept : {0.0, 0.5, 0.1}) {
            simplify::Options options{.method = method, .grid_spacing = spacing};
            if (kept > 0.0)
                options.target_vertices =
                    std::max<std::size_t>(1, std::size_t(kept * double(mesh.vertices.size())));
            INFO(to_string(method) << ", kept " << kept);
            require_sound(mesh, simplify::simplify(mesh, features, options).mesh);
        }
}

/// Leaves out triangles of a mesh to make holes that do not touch, so that it stays manifold.
TriangleMesh with_holes(const TriangleMesh& mesh, std::uint32_t every) {
    TriangleMesh result = mesh;
    result.triangles.clear();
    std::vector<std::uint8_t> near_hole(mesh.vertices.size(), 0);
    for (const std::uint32_t v : surface::analyse_topology(mesh).boundary_loops.items) near_hole[v] = 1;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& triangle = mesh.triangles[t];
        const bool clear =
            std::none_of(triangle.begin(), triangle.end(), [&](auto v) { return near_hole[v]; });
        if (t % every == 0 && clear)
            for (const std::uint32_t v : triangle) near_hole[v] = 1;
        else
            result.triangles.push_back(triangle);
    }
    return result;
}

TriangleMesh moved(TriangleMesh mesh, const Vec3& by) {
    for (Vec3& p : mesh.vertices) p += by;
    return mesh;
}

/// A disk of \p spokes triangles around its centre.
TriangleMesh fan(std::uint32_t spokes) {
    TriangleMesh mesh;
    mesh.vertices.emplace_back(0, 0, 0);
    for (std::uint32_t i = 0; i < spokes; ++i)
        mesh.vertices.emplace_back(std::cos(2 * M_PI * i / spokes), std::sin(2 * M_PI * i / spokes), 0.0);
    for (std::uint32_t i = 0; i < spokes; ++i) mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % spokes});
    return mesh;
}

/// A Moebius strip of \p n quadrilaterals.
TriangleMesh moebius(std::uint32_t n) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < n; ++i)
        for (const double s : {-0.3, 0.3}) {
            const double u = 2 * M_PI * i / n;
            const double r = 1.0 + s * std::cos(u / 2);
            mesh.vertices.emplace_back(r * std::cos(u), r * std::sin(u), s * std::sin(u / 2));
        }
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = 2 * i, b = 2 * i + 1;
        const std::uint32_t c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? b + 2 : 0;
        mesh.triangles.push_back({a, c, b});
        mesh.triangles.push_back({b, c, d});
    }
    return mesh;
}

}  // namespace

TEST_CASE("noisy copies of a trench stay sound and unflipped") {
    const Field field = trench_field();
    for (const double roughness : {0.03, 0.1, 0.2}) {
        const TriangleMesh mesh = trench_mesh(0.4, roughness);
        const auto features = features_of(mesh, 0.4);
        simplify_all(mesh, features, 0.4);
        if (roughness > 0.05) continue;
        for (const Method method : kMethods) {
            const auto coarse = simplify::simplify(
                mesh, features,
                {.method = method, .target_vertices = mesh.vertices.size() / 5, .grid_spacing = 0.4});
            CHECK(flipped(coarse.mesh, field) <= flipped(mesh, field));
        }
    }
}

TEST_CASE("a mesh large enough for blocks stays sound, and threads do not matter", "[slow]") {
    const TriangleMesh mesh = trench_mesh(0.16, 0.05);
    REQUIRE(mesh.vertices.size() > 20'000);
    const auto features = features_of(mesh, 0.16);
    const std::size_t target = mesh.vertices.size() / 10;
    for (const Method method : kMethods)
        for (const bool aimed : {true, false}) {
            simplify::Options options{.method = method, .grid_spacing = 0.16};
            if (aimed) options.target_vertices = target;
            TriangleMesh first;
            for (const std::size_t threads : {1, 2, 3}) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
                const TriangleMesh coarse = simplify::simplify(mesh, features, options).mesh;
                if (threads == 1) first = coarse;
                CHECK(same_bits(first, coarse));
            }
            if (aimed) CHECK(first.vertices.size() == target);
            require_sound(mesh, first);
            CHECK(surface::boundary_on_rectangle(first, surface::analyse_topology(first)));
        }
}

TEST_CASE("a hard bound holds in both directions, at any target", "[slow]") {
    for (const double roughness : {0.0, 0.05}) {
        const TriangleMesh mesh = trench_mesh(0.2, roughness);
        const auto features = features_of(mesh, 0.2);
        for (const Method method : kMethods)
            for (const double bound : {0.002, 0.02, 0.1})
                for (const std::optional<std::size_t> target :
                     {std::optional<std::size_t>{}, {std::size_t{1}}}) {
                    const simplify::Options options{.method = method,
                                                    .l_max = 2.0,
                                                    .target_vertices = target,
                                                    .max_error = bound,
                                                    .grid_spacing = 0.2};
                    const TriangleMesh coarse = simplify::simplify(mesh, features, options).mesh;
                    CHECK(coarse.vertices.size() < mesh.vertices.size());
                    // The distance search's tree is single precision, its distances are double precision.
                    CHECK(surface::two_sided_distance(mesh, coarse).max <= bound * (1.0 + 1e-9));
                }
    }
}

TEST_CASE("no method moves a fixed vertex, nor removes one") {
    const TriangleMesh mesh = trench_mesh(0.5, 0.05);
    const Box3 box = bounding_box(mesh);
    std::vector<std::uint8_t> fixed;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        fixed.push_back(mesh.vertices[v].y() == box.min.y() || v % 50 == 0);
    for (const Method method :
         {Method::lindstrom_turk, Method::region, Method::region_bounded, Method::cgal_lindstrom_turk}) {
        simplify::Options options{.method = method, .target_vertices = 1, .grid_spacing = 0.5};
        const auto features = features_of(mesh, 0.5);
        const auto lost = [&] {
            const TriangleMesh coarse = simplify::simplify(mesh, features, options).mesh;
            const Places left = places(coarse);
            std::size_t count = 0;
            for (std::size_t v = 0; v < fixed.size(); ++v)
                count += fixed[v] && !left.contains(mesh.vertices[v]);
            return count;
        };
        CHECK(lost() > 0);
        options.fixed = fixed;
        CHECK(lost() == 0);
        options.fixed = std::span(fixed).first(5);
        CHECK_THROWS_AS(simplify::simplify(mesh, features, options), GeometryError);
    }
}

TEST_CASE("region-bounded keeps to the lengths it is given") {
    const TriangleMesh mesh = square_mesh(60, 1.0);
    std::vector<double> lengths(mesh.vertices.size(), std::numeric_limits<double>::infinity());
    for (std::size_t v = 0; v < lengths.size(); ++v)
        if (mesh.vertices[v].x() < 20.0) lengths[v] = 0.5;  // every edge is longer: no vertex may go
    const std::vector<std::uint8_t> none(mesh.vertices.size(), 0);
    const auto result = simplify::simplify(
        mesh, none, {.method = Method::region_bounded, .target_vertices = 1, .max_length_at = lengths});
    std::size_t left = 0;
    for (const Vec3& p : result.mesh.vertices) left += p.x() < 20.0;
    CHECK(left == 20 * 61);
    CHECK(result.mesh.vertices.size() < 61 * 30);
    CHECK_THROWS_AS(
        simplify::simplify(mesh, none,
                           {.method = Method::region_bounded, .max_length_at = std::span(lengths).first(5)}),
        GeometryError);
}

TEST_CASE("region-bounded is no farther from the surface than region at equal vertices") {
    const TriangleMesh mesh = trench_mesh(0.2, 0.03);
    const auto features = surface::feature_flags(mesh, 0.2, 0.5);
    for (const double kept : {0.8, 0.5, 0.3, 0.2, 0.1}) {
        simplify::Options options{.method = Method::region,
                                  .target_vertices = std::size_t(kept * double(mesh.vertices.size())),
                                  .grid_spacing = 0.2};
        const auto region = surface::distance(mesh, simplify::simplify(mesh, features, options).mesh);
        options.method = Method::region_bounded;
        const auto bounded = surface::distance(mesh, simplify::simplify(mesh, features, options).mesh);
        CHECK(bounded.max <= region.max);
        // The margin is for meshes where next to nothing is removed and both means are almost zero.
        CHECK(bounded.mean <= std::max(region.mean, 0.001 * 0.2));
    }
}

TEST_CASE("holes, components and closed surfaces stay what they are") {
    const TriangleMesh ball = sphere_mesh(1.0, 16), ring = torus_mesh(1.0, 0.4, 20);
    simplify_all(ball, features_of(ball, 0.16), 0.16);
    simplify_all(ring, features_of(ring, 0.14), 0.14);
    const TriangleMesh pierced = with_holes(ball, 5);
    REQUIRE(surface::analyse_topology(pierced).manifold());
    REQUIRE(surface::analyse_topology(pierced).boundary_loops.size() > 50);
    simplify_all(pierced, features_of(pierced, 0.16), 0.16);
    const TriangleMesh many =
        joined({ball, moved(ring, Vec3(5, 0, 0)), moved(ball, Vec3(0, 9, 0)),
                moved(square_mesh(8, 0.2), Vec3(0, 0, 7)), moved(fan(7), Vec3(-5, 0, 0))});
    simplify_all(many, features_of(many, 0.16), 0.16);
}

TEST_CASE("fans, single triangles and a strip with half a turn", "[slow]") {
    for (const std::uint32_t spokes : {3u, 4u, 7u, 300u, 70'000u})
        simplify_all(fan(spokes), {std::vector<std::uint8_t>(spokes + 1, 0)}, 0.1);
    TriangleMesh one;
    one.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
    one.triangles = {{0, 1, 2}};
    for (const Method method : kMethods)
        CHECK(same_bits(
            simplify::simplify(one, std::vector<std::uint8_t>(3, 0), {.method = method, .target_vertices = 1})
                .mesh,
            one));
    const TriangleMesh strip = moebius(40);
    for (const Method method : kMethods)
        CHECK_THROWS_WITH(simplify::simplify(strip, std::vector<std::uint8_t>(80, 0), {.method = method}),
                          Catch::Contains("oriented against each other"));
}

TEST_CASE("a thousand random meshes stay sound", "[slow]") {
    std::mt19937 random(7);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * double(random() >> 5) / double(1u << 27);
    };
    for (int i = 0; i < 1000; ++i) {
        TriangleMesh mesh;
        switch (i % 4) {
            case 0:
                mesh = square_mesh(2 + i % 9, 1.0);
                break;
            case 1:
                mesh = sphere_mesh(1.0, 5 + i % 5);
                break;
            case 2:
                mesh = with_holes(torus_mesh(1.0, 0.4, 8 + i % 5), 3 + std::uint32_t(i % 7));
                break;
            default:
                mesh = with_holes(square_mesh(4 + i % 9, 0.3), 4 + std::uint32_t(i % 5));
                break;
        }
        // Some meshes are rough; some get coincident vertices and triangles without area.
        const double roughness = i % 3 == 0 ? 0.0 : uniform(0.0, 0.3);
        for (Vec3& p : mesh.vertices) p += roughness * Vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        if (i % 10 == 9)
            for (std::size_t v = 3; v + 1 < mesh.vertices.size(); v += 7)
                mesh.vertices[v] = mesh.vertices[v + 1];
        std::vector<std::uint8_t> fixed;
        if (i % 5 == 4)
            for (std::size_t v = 0; v < mesh.vertices.size(); ++v) fixed.push_back(random() % 8 == 0);
        std::vector<std::uint8_t> features(mesh.vertices.size(), 0);
        for (auto& f : features) f = random() % 5 == 0;
        simplify::Options options{.method = kMethods[random() % 3]};
        options.fixed = fixed;
        if (random() % 2) options.target_vertices = 1 + random() % mesh.vertices.size();
        if (random() % 2) options.max_error = uniform(0.001, 0.5);
        if (random() % 3 == 0)
            options.weights = simplify::Weights{uniform(0.1, 1), uniform(0, 1), uniform(0, 1)};
        INFO("mesh " << i << ", " << to_string(options.method));
        const auto result = simplify::simplify(mesh, features, options);
        require_sound(mesh, result.mesh);
        if (options.max_error)
            REQUIRE(surface::two_sided_distance(mesh, result.mesh).max <= *options.max_error * (1.0 + 1e-9));
    }
}

TEST_CASE("a fan is simplified in time proportional to its triangles") {
    // Flat, with its rim on a line: all rim vertices may go, one neighbour of the hub after the other.
    const auto fan = [](std::uint32_t n) {
        TriangleMesh mesh;
        mesh.vertices.emplace_back(0.5, 1.0, 0.0);
        for (std::uint32_t i = 0; i <= n; ++i) mesh.vertices.emplace_back(double(i) / n, 0.0, 0.0);
        for (std::uint32_t i = 1; i <= n; ++i) mesh.triangles.push_back({0, i, i + 1});
        return mesh;
    };
    for (const Method method : kMethods) {
        const auto cpu_seconds = [&](std::uint32_t n) {
            const TriangleMesh mesh = fan(n);
            const std::clock_t start = std::clock();
            const auto features = surface::feature_flags(mesh, 1.0 / n, 0.2);
            simplify::simplify(mesh, features, {.method = method});
            return double(std::clock() - start) / CLOCKS_PER_SEC;
        };
        // Four times the triangles take 4 times as long if linear, 16 if quadratic; CPU time on a busy
        // machine is good to a factor of two.
        const double few = std::max(0.02, cpu_seconds(6000));
        INFO(to_string(method));
        CHECK(cpu_seconds(24000) < 9.0 * few);
    }
}
