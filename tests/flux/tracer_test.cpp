#include "flux/tracer/tracer.hpp"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "flux/random.hpp"
#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"

using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;

namespace {

TriangleMesh deep_trench(double depth, std::size_t rows = 2) {
    return extrude(trench_profile(depth, 0.1, {0.25, 0.5, 0.75}, {0.5}), 0.7, rows);
}

// Steep, acute-angled and irregular: neighbouring heights differ by more than a cell. Opposite sides match.
TriangleMesh rough_surface(std::size_t cells) {
    return height_field(cells, cells, 1.0, std::sqrt(0.5), [&](std::size_t i, std::size_t j) {
        const Draws d = draw(random_key(11, 0, 0), (i % cells) * cells + j % cells, 0);
        return 3.0 / static_cast<double>(cells) * d.uniform(0);
    });
}

bool same_bits(const FluxField& a, const FluxField& b) {
    return a.flux == b.flux && a.error == b.error;
}

}  // namespace

TEST_CASE("every particle is absorbed or escapes, and none leaks", "[slow]") {
    SECTION("from a deep trench") {
        const auto mesh = deep_trench(20.0);
        for (const auto& boundary : {kReflective, kPeriodic}) {
            const auto result = trace(mesh, boundary, {"test", 1.0, {0.05}}, {.rays = 200'000});
            check_balance(result);
            CHECK(result.arrivals > 2 * result.emitted);
        }
    }
    SECTION("from a rough surface with acute grooves") {
        const auto mesh = rough_surface(40);
        for (const auto& boundary : {kReflective, kPeriodic})
            for (const double exponent : {1.0, 1000.0}) {
                const auto result = trace(mesh, boundary, {"test", exponent, {0.1}}, {.rays = 300'000});
                check_balance(result);
                // Rounding puts a particle behind the surface with a chance of about 1e-6 an arrival.
                CHECK(static_cast<double>(result.rescued) < 1e-4 * static_cast<double>(result.arrivals));
            }
    }
    SECTION("from walls and floors that meet the sides in every way, at coordinates float cannot hold") {
        auto mesh = turned(rough_surface(5));
        for (Vec3& p : mesh.vertices) p = (p + Vec3(7.1, -3.3, 0.7)) / 3.0;
        check_balance(trace(mesh, kPeriodic, {"test", 1.0, {0.1}}, {.rays = 1'000'000}));
        check_balance(trace(mesh, kReflective, {"test", 1.0, {0.1}}, {.rays = 1'000'000}));
    }
    SECTION("from a round rim: grazing particles meet the edge between plate and wall") {
        const auto mesh = round_hole(1.0, 10.0, 1.02, 128, 0.5).mesh;
        check_balance(trace(mesh, kReflective, {"test", 1.0, {1.0}}, {.rays = 3'000'000}));
    }
    SECTION("from a hole that absorbs nothing: all escape") {
        const auto hole = round_hole(1.0, 2.0, 1.1, 16, 0.3);
        const auto result = trace(hole.mesh, kReflective, {"test", 1.0, {0.0}}, {.rays = 100'000});
        check_balance(result);
        CHECK(result.escaped == result.emitted);
        CHECK(result.absorbed == 0);
    }
    SECTION("from a slit whose walls lie in the sides' planes") {
        const auto mesh = extrude({{0.0, 0.0}, {0.0, -2.0}, {1.0, -2.0}, {1.0, 0.0}}, 1.0);
        check_balance(trace(mesh, kReflective, {"test", 1.0, {0.1}}, {.rays = 100'000}));
        check_balance(trace(mesh, kPeriodic, {"test", 1.0, {0.1}}, {.rays = 100'000}));
    }
}

TEST_CASE("a surface in equilibrium: nothing absorbed means flux 1 everywhere, whatever the shape") {
    // Detailed balance of Lambertian emission in a closed form: the gas outside is an isotropic reservoir.
    const auto boundary = GENERATE(Boundary::reflective, Boundary::periodic);
    const auto mesh = GENERATE(deep_trench(3.0), rough_surface(6));
    const auto result = trace(mesh, {boundary, boundary}, {"test", 1.0, {0.0}}, {.rays = 400'000});
    check_balance(result);
    double worst = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        worst = std::max(worst, std::abs(result.triangle.flux[t] - 1.0) / result.triangle.error[t]);
    // The largest of 72 values of Student's t (31 degrees of freedom), 4 times over, exceeds 5 in 1 of 200.
    CHECK(worst < 5.0);
    const Mean all = mean_flux(mesh, result, [](std::size_t) { return true; });
    CHECK(std::abs(all.flux - 1.0) < 0.01);
}

TEST_CASE("the tallies agree with each other: arrivals by triangle, wedge and vertex") {
    const auto mesh = deep_trench(3.0);
    const auto wedges = make_wedges(mesh);
    const auto result = trace(mesh, kPeriodic, {"test", 1.0, {0.3}}, {.rays = 50'000});
    double triangles = 0.0, by_wedge = 0.0, by_vertex = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        triangles += result.triangle.flux[t] * triangle_area(mesh, t);
    for (std::size_t w = 0; w < wedges.count(); ++w) by_wedge += result.wedge.flux[w] * wedges.area[w];
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        double area = 0.0;
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) area += wedges.area[w];
        by_vertex += result.vertex.flux[v] * area;
    }
    const double expected = static_cast<double>(result.arrivals) / static_cast<double>(result.emitted) *
                            lateral_box(mesh, kPeriodic).area();
    CHECK(triangles == Approx(expected).epsilon(1e-12));
    CHECK(by_wedge == Approx(expected).epsilon(1e-12));
    CHECK(by_vertex == Approx(expected).epsilon(1e-12));
    CHECK(result.relative_error > 0.0);
    CHECK(result.relative_error < 1.0);
}

namespace {

// A species for each way to trace a block: neutrals that all stick, neutrals with weights, ions that sputter,
// neutrals in a gas.
std::vector<Species> kinds() {
    Species ions = ion("ion");
    ions.reflection.from = 0.5;
    ions.yields = {{"sputter", Angular::sputter, 20.0, {0.1}, {9.3}}};
    ions.redeposition = Redeposition{{"out", Angular::cosine, 20.0, {0.1}, {}}, Reemission::coned, {0.5}};
    Species gas{"gas", 1.0, {0.2}};
    gas.mean_free_path = 0.5;
    return {{"stick", 1.0, {1.0}}, {"neutral", 1.0, {0.1}}, ions, gas};
}

void check_same_bits(const FluxResult& a, const FluxResult& b) {
    for (std::size_t k = 0; k <= a.others.size(); ++k) {
        CHECK(same_bits(a.tally(k).triangle, b.tally(k).triangle));
        CHECK(same_bits(a.tally(k).wedge, b.tally(k).wedge));
        CHECK(same_bits(a.tally(k).vertex, b.tally(k).vertex));
    }
    CHECK(a.relative_error == b.relative_error);
    CHECK(a.absorbed == b.absorbed);
    CHECK(a.escaped == b.escaped);
    CHECK(a.segments == b.segments);
    CHECK(a.rescued == b.rescued);
    CHECK(a.arrivals == b.arrivals);
    CHECK(a.ledger == b.ledger);
    CHECK(a.redeposited == b.redeposited);
}

}  // namespace

TEST_CASE("the flux has the same bits for any number of threads and any task size", "[slow]") {
    const auto mesh = deep_trench(3.0, 20);
    const surface::RayScene scene(mesh);
    const auto box = lateral_box(mesh, kPeriodic);
    const auto wedges = make_wedges(mesh);
    const Species species = GENERATE(from_range(kinds()));
    // 16 batches of 12 blocks and a bit; tasks of 1, 1, 2, 5 and all blocks of a batch.
    constexpr std::uint64_t kRays = 200'000;
    const auto run = [&](int threads, std::uint32_t task_rays, double target) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        static_cast<std::size_t>(threads));
        tbb::task_arena arena(threads);
        return arena.execute([&] {
            TraceOptions options{.rays = kRays, .batches = 16, .task_rays = task_rays, .roulette = 0.2};
            if (target > 0.0) options.relative_error = target;
            return trace_flux(mesh, scene, box, species, {}, wedges, options);
        });
    };
    const FluxResult one = run(1, 1024, 0.0);
    CHECK(one.emitted == kRays);
    for (const std::uint32_t task_rays : {1u, 1024u, 2500u, 5120u, 1'000'000u})
        for (const int threads : {1, 2, 3}) {
            CAPTURE(species.name, task_rays, threads);
            check_same_bits(one, run(threads, task_rays, 0.0));
        }
    SECTION("when tracing to a target error, too") {
        const FluxResult reached = run(1, 1024, 0.1);
        CHECK(reached.emitted < kRays);  // the target is reached before all rays are traced
        for (const int threads : {2, 3}) check_same_bits(reached, run(threads, 3000, 0.1));
    }
    SECTION("and other bits for another seed, time step or species") {
        const auto with = [&](TraceOptions options) {
            options.rays = 20'000;
            return trace(mesh, kPeriodic, species, options).triangle.flux;
        };
        const auto plain = with({});
        CHECK(with({}) == plain);
        CHECK(with({.seed = 2}) != plain);
        CHECK(with({.time_step = 1}) != plain);
        CHECK(with({.species_index = 1}) != plain);
    }
}

TEST_CASE("standard errors have the size of the scatter between seeds") {
    // Re-emission correlates arrivals, stratification anticorrelates them: batches must show both.
    const double sticking = GENERATE(1.0, 0.1);
    const auto mesh = deep_trench(2.0, 1);
    const auto wedges = make_wedges(mesh);
    const surface::RayScene scene(mesh);
    const auto box = lateral_box(mesh, kPeriodic);
    constexpr int kSeeds = 300;
    const std::size_t triangles = mesh.triangles.size(), vertices = mesh.vertices.size();
    // Indexed by triangles, then wedges, then vertices.
    std::vector<double> sum(triangles + wedges.count() + vertices, 0.0), squares = sum, predicted = sum;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const auto result = trace_flux(mesh, scene, box, {"test", 1.0, {sticking}}, {}, wedges,
                                       {.rays = 4096, .seed = static_cast<std::uint64_t>(seed)});
        std::size_t i = 0;
        for (const FluxField* field : {&result.triangle, &result.wedge, &result.vertex})
            for (std::size_t k = 0; k < field->flux.size(); ++k, ++i) {
                sum[i] += field->flux[k];
                squares[i] += field->flux[k] * field->flux[k];
                predicted[i] += field->error[k] * field->error[k] / kSeeds;
            }
    }
    double pooled = 0.0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
        const double variance = (squares[i] - sum[i] * sum[i] / kSeeds) / (kSeeds - 1);
        CAPTURE(i, variance, predicted[i]);
        // Chi-square of 299 degrees of freedom: relative deviation sqrt(2 / 299) = 0.082; 5 of it for 100
        // elements.
        CHECK(std::abs(variance / predicted[i] - 1.0) < 5.0 * std::sqrt(2.0 / (kSeeds - 1)));
        pooled += variance / predicted[i] / static_cast<double>(sum.size());
    }
    CHECK(std::abs(pooled - 1.0) < 0.15);
}

namespace {

// A period of an asymmetric profile: deep slot, slope and ledge. Segment k runs from point k to point k + 1,
// the last one to the first point of the next period (2 on).
const Profile kPeriod{{0.0, 0.0},  {0.3, 0.0},  {0.3, -1.5}, {0.5, -1.5}, {0.7, -1.5},
                      {0.7, -0.6}, {1.1, -0.6}, {1.3, -0.2}, {1.8, 0.0}};

Profile cut_at(std::size_t start) {
    Profile profile;
    for (std::size_t k = 0; k <= kPeriod.size(); ++k) {
        const std::size_t i = start + k;
        profile.emplace_back(kPeriod[i % kPeriod.size()].first + (i >= kPeriod.size() ? 2.0 : 0.0),
                             kPeriod[i % kPeriod.size()].second);
    }
    return profile;
}

Mean segment_flux(const TriangleMesh& mesh, const FluxResult& result, std::size_t segment) {
    return mean_flux(mesh, result, [&](std::size_t t) { return t / 2 == segment; });
}

void check_same(const Mean& a, const Mean& b) {
    CAPTURE(a.flux, b.flux, a.error, b.error);
    // 4.5 sigma: 27 comparisons, errors from 32 batches, triangles of a segment taken as independent.
    CHECK(std::abs(a.flux - b.flux) < 4.5 * std::hypot(a.error, b.error));
    CHECK(std::hypot(a.error, b.error) < 0.03 * a.flux);
}

}  // namespace

TEST_CASE("a shifted periodic domain has the same flux, wherever its sides cut the surface") {
    const auto original = extrude(cut_at(0), 0.5);
    const auto expected = trace(original, kPeriodic, {"test", 1.0, {0.3}}, {.rays = 1'000'000});
    const std::size_t n = kPeriod.size();
    for (const std::size_t start : {3u, 6u}) {  // in the slot's floor, in the slope's foot
        const auto shifted = extrude(cut_at(start), 0.5);
        const auto result = trace(shifted, kPeriodic, {"test", 1.0, {0.3}}, {.rays = 1'000'000, .seed = 2});
        check_balance(result);
        for (std::size_t k = 0; k < n; ++k)
            check_same(segment_flux(original, expected, (start + k) % n), segment_flux(shifted, result, k));
    }
}

TEST_CASE("a mirrored surface has the mirrored flux") {
    Profile mirrored;
    const Profile profile = cut_at(0);
    for (auto point = profile.rbegin(); point != profile.rend(); ++point)
        mirrored.emplace_back(-point->first, point->second);
    const auto a = extrude(profile, 0.5), b = extrude(mirrored, 0.5);
    const auto boundary = GENERATE(kPeriodic, kReflective);
    const auto left = trace(a, boundary, {"test", 1.0, {0.3}}, {.rays = 500'000});
    const auto right = trace(b, boundary, {"test", 1.0, {0.3}}, {.rays = 500'000, .seed = 2});
    for (std::size_t k = 0; k < kPeriod.size(); ++k)
        check_same(segment_flux(a, left, k), segment_flux(b, right, kPeriod.size() - 1 - k));
}

TEST_CASE("half of a symmetric trench between reflective sides is the whole trench") {
    const auto whole = extrude(trench_profile(2.0, 0.25, {0.5}, {0.5}), 0.5);
    // From the trench's axis to the middle of the ledge.
    const auto half = extrude({{0.0, -2.0}, {0.5, -2.0}, {0.5, -1.0}, {0.5, 0.0}, {0.75, 0.0}}, 0.5);
    const auto expected = trace(whole, kPeriodic, {"test", 1.0, {0.3}}, {.rays = 1'000'000});
    const auto result = trace(half, kReflective, {"test", 1.0, {0.3}}, {.rays = 1'000'000});
    for (std::size_t k = 0; k < 4; ++k)
        check_same(segment_flux(whole, expected, 4 + k), segment_flux(half, result, k));
}

TEST_CASE("a collimated beam reaches the floor of a deep trench and no wall sees more than its spread") {
    const auto mesh = deep_trench(10.0);
    const auto result = trace(mesh, kReflective, {"ion", 5000.0, {1.0}}, {.rays = 100'000});
    check_balance(result);
    const Mean floor =
        mean_flux(mesh, result, [&](std::size_t t) { return triangle_centroid(mesh, t).z() < -9.99; });
    // Walls take what the floor lacks: a beam of angular spread 1/sqrt(n + 2) about the normal in x drifts by
    // depth/sqrt(n + 2) = 0.14; the mean absolute drift, 0.8 of it, is the share lost from a width of 1.
    CHECK(floor.flux == Approx(1.0 - std::sqrt(2.0 / 3.14159265) * 10.0 / std::sqrt(5002.0))
                            .margin(4.0 * floor.error + 0.002));
}

TEST_CASE("with open sides, what passes the rim of a body escapes and the rest balances") {
    TriangleMesh mesh;  // an octahedron
    mesh.vertices = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}};
    const auto result =
        trace(mesh, {Boundary::open, Boundary::open}, {"beam", 1e5, {1.0}}, {.rays = 100'000});
    check_balance(result);
    // A vertical beam sees half of the bounding square.
    CHECK(static_cast<double>(result.absorbed) / static_cast<double>(result.emitted) ==
          Approx(0.5).margin(0.01));
    for (std::size_t t = 4; t < 8; ++t) CHECK(result.triangle.flux[t] == 0.0);
    for (std::size_t t = 0; t < 4; ++t)
        CHECK(result.triangle.flux[t] == Approx(1.0 / std::sqrt(3.0)).margin(0.02));
}

TEST_CASE("a torn surface leaks, and says so") {
    auto mesh = height_field(8, 8, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const LateralBox box = lateral_box(mesh, kReflective);
    mesh.triangles.erase(mesh.triangles.begin() + 64);
    const auto result =
        trace_flux(mesh, surface::RayScene(mesh), box, {}, {}, make_wedges(mesh), {.rays = 12'800});
    CHECK(result.emitted == result.absorbed + result.escaped + result.leaked);
    CHECK(static_cast<double>(result.leaked) == Approx(100.0).margin(5.0 * 10.0));
}

TEST_CASE("a particle that bounces beyond the cap is counted as leaked, never lost") {
    const auto mesh = deep_trench(3.0);
    const auto result = trace(mesh, kPeriodic, {"test", 1.0, {0.0}}, {.rays = 10'000, .max_bounces = 2});
    CHECK(result.leaked > 0);
    CHECK(result.emitted == result.escaped + result.leaked);
}

TEST_CASE("tracing to a target error reaches it, or says how far it came") {
    const auto mesh = deep_trench(2.0, 8);
    const surface::RayScene scene(mesh);
    const auto box = lateral_box(mesh, kPeriodic);
    const auto wedges = make_wedges(mesh);
    const auto result =
        trace_flux(mesh, scene, box, {}, {}, wedges, {.rays = 10'000'000, .relative_error = 0.03});
    CHECK(result.relative_error <= 0.03);
    CHECK(result.relative_error > 0.01);  // not traced ten times as long as necessary
    const auto capped =
        trace_flux(mesh, scene, box, {}, {}, wedges, {.rays = 20'000, .relative_error = 1e-4});
    CHECK(capped.relative_error > 1e-4);
    CHECK(capped.emitted >= 20'000);
    CHECK(capped.emitted < 21'000);
    CHECK_THROWS_AS(trace_flux(mesh, scene, box, {}, {}, wedges, {.relative_error = 0.0}), RecipeError);
}

TEST_CASE("the trace reports its progress and stops when asked") {
    const auto mesh = deep_trench(2.0);
    double last = 0.0;
    TraceOptions options{.rays = 50'000};
    options.progress = [&](double fraction) {
        CHECK(fraction > 0.0);
        CHECK(fraction <= 1.0);
        last = std::max(last, fraction);
    };
    trace(mesh, kPeriodic, {}, options);
    CHECK(last > 0.9);
    std::atomic<int> asked = 0;
    options.stop = [&] { return ++asked > 5; };
    CHECK_THROWS_AS(trace(mesh, kPeriodic, {}, options), Interrupted);
    CHECK(asked < 20);
}

TEST_CASE("species and options out of range are refused by name and value") {
    const auto mesh = deep_trench(1.0);
    const double nan = std::nan("");
    const auto refused = [&](const Species& species, const TraceOptions& options, const std::string& text) {
        CAPTURE(text);
        CHECK_THROWS_AS(trace(mesh, kPeriodic, species, options), RecipeError);
        CHECK_THROWS_WITH(trace(mesh, kPeriodic, species, options), Contains(text));
    };
    refused({"O", 1.0, {1.4}}, {}, "O: sticking = 1.4: must be in [0, 1]");
    refused({"O", 1.0, {-0.1}}, {}, "sticking = -0.1");
    refused({"O", 1.0, {0.5, nan}}, {}, "sticking = nan");
    refused({"O", 1.0, {}}, {}, "no sticking");
    refused({"O", -1.0, {1.0}}, {}, "source_exponent = -1");
    refused({"O", nan, {1.0}}, {}, "source_exponent = nan");
    refused({}, {.rays = 0}, "rays = 0");
    refused({}, {.batches = 15}, "batches = 15");
    refused({}, {.task_rays = 0}, "task_rays");

    const surface::RayScene scene(mesh);
    const auto box = lateral_box(mesh, kPeriodic);
    const auto wedges = make_wedges(mesh);
    const std::vector<std::int32_t> few(3, 0), unknown(mesh.triangles.size(), 2),
        negative(mesh.triangles.size(), -1);
    const Species two{"two", 1.0, {0.1, 0.2}};
    CHECK_THROWS_AS(trace_flux(mesh, scene, box, two, few, wedges), GeometryError);
    CHECK_THROWS_WITH(trace_flux(mesh, scene, box, two, unknown, wedges), Contains("material 2"));
    CHECK_THROWS_AS(trace_flux(mesh, scene, box, two, negative, wedges), RecipeError);
    CHECK_THROWS_AS(trace_flux(mesh, scene, box, {}, {}, make_wedges(deep_trench(1.0, 3))), GeometryError);
    CHECK_THROWS_AS(trace_flux(mesh, scene, {}, {}, {}, wedges), GeometryError);
}
