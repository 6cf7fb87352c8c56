#include "flux/tracer/adjoint.hpp"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

TriangleMesh trench() {
    return extrude(trench_profile(2.0, 0.4, {0.25, 0.5, 0.75}, {0.25, 0.5, 0.75}), 1.0, 4);
}

// Ions with yields, a grazing reflection that funnels to the floor, and redeposition elsewhere.
Species ions() {
    Species ions = ion("ion", {100.0, 10.0}, 100.0);
    ions.yields = {{"sputter", Angular::sputter, 20.0, {0.1}, {9.3}}};
    ions.redeposition = Redeposition{{"out", Angular::cosine, 20.0, {0.1}, {}}, Reemission::coned, {0.5}};
    return ions;
}

Species narrow(double exponent = 1000.0) {
    return {"beam", exponent, {1.0}};
}

double area_mean(const TriangleMesh& mesh, const FluxField& triangle, std::size_t first, std::size_t last) {
    double sum = 0.0, area = 0.0;
    for (std::size_t t = first; t < last; ++t) {
        sum += triangle_area(mesh, t) * triangle.flux[t];
        area += triangle_area(mesh, t);
    }
    return sum / area;
}

// Mean over traces, and the variance of that mean.
struct Estimate {
    double sum = 0.0, squares = 0.0, count = 0.0;
    void add(double x) { sum += x, squares += x * x, ++count; }
    double mean() const { return sum / count; }
    double variance() const { return std::max(0.0, squares / count - mean() * mean()) / (count - 1.0); }
};

}  // namespace

TEST_CASE("adjoint paths from flat ground give its flux exactly, whatever the source's exponent") {
    const double exponent = GENERATE(50.0, 1000.0, 1e5);
    const auto mesh = height_field(5, 4, 1.3, 0.9, [](std::size_t, std::size_t) { return 0.25; });
    const auto boundary = GENERATE(kReflective, kPeriodic);
    const FluxResult result = trace(mesh, boundary, narrow(exponent), {.rays = 4 * 3 * 40, .adjoint = true});
    CHECK(result.emitted == 4u * 3u * 40u);
    CHECK(result.absorbed == result.emitted);
    // Weights are multiples of 2^-28 particles; an element sums about a dozen of them.
    for (const FluxField* field : {&result.triangle, &result.wedge, &result.vertex})
        for (std::size_t k = 0; k < field->flux.size(); ++k) {
            CHECK(field->flux[k] == Approx(1.0).epsilon(1e-6));
            CHECK(field->error[k] < 1e-6);
        }
}

TEST_CASE("a slope that nothing hides gets the cosine's share of a narrow beam by adjoint paths") {
    // Walls at 60 degrees under a beam of 0.1 degrees: cos(60) on both, within the beam's spread of 1e-3.
    const auto mesh = extrude({{0.0, 0.0}, {1.0, std::sqrt(3.0)}, {2.0, 0.0}}, 1.0, 3);
    const FluxResult result = trace(mesh, kPeriodic, narrow(1e6), {.rays = 20'000, .adjoint = true});
    for (const double flux : result.triangle.flux) CHECK(flux == Approx(0.5).epsilon(2e-3));
}

TEST_CASE("adjoint and forward fluxes agree, with yields, reflections and redeposition") {
    const auto mesh = trench();
    const Species species = GENERATE(narrow(60.0), ions());
    const std::array sides{Boundary::reflective, GENERATE(Boundary::periodic, Boundary::open)};
    constexpr std::size_t kStrip = 8;  // triangles for each segment of the profile
    const std::size_t strips = mesh.triangles.size() / kStrip, tallies = tally_count(species);
    constexpr int kSeeds = 24;
    std::vector<Estimate> by_way[2];
    for (std::vector<Estimate>& one : by_way) one.resize(strips * tallies);
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
        for (const bool adjoint : {false, true}) {
            const FluxResult result =
                trace(mesh, sides, species, {.rays = 60'000, .seed = seed, .adjoint = adjoint});
            CHECK(result.ledger.balanced());
            CHECK(result.redeposited.balanced());
            CHECK(result.leaked == 0);
            CHECK(result.emitted == result.absorbed + result.escaped);
            for (std::size_t k = 0; k < tallies; ++k)
                for (std::size_t s = 0; s < strips; ++s)
                    by_way[adjoint ? 1 : 0][k * strips + s].add(
                        area_mean(mesh, result.tally(k).triangle, kStrip * s, kStrip * (s + 1)));
        }
    for (std::size_t n = 0; n < strips * tallies; ++n) {
        const Estimate &down = by_way[0][n], &up = by_way[1][n];
        CAPTURE(species.name, n / strips, n % strips, down.mean(), up.mean());
        if (down.mean() == 0.0) {  // sputtered particles leave the ledges upwards; none lands on them
            CHECK(n / strips == 2);
            CHECK(up.mean() == 0.0);
            continue;
        }
        // About 30 means of 46 degrees of freedom: in a thousand tests none is off by as much.
        CHECK(std::abs(up.mean() - down.mean()) < 5.0 * std::sqrt(up.variance() + down.variance()));
        CHECK(std::sqrt(up.variance()) < 0.04 * up.mean());  // a bias of a fifth would show
    }
}

TEST_CASE(
    "adjoint paths from triangles of very different sizes weigh what they stand for, however much that is") {
    // A plate, half of it 2 triangles, half 2000 slivers: a path from a large one weighs 500 particles.
    Profile profile{{0.0, 0.0}, {1.0, 0.0}};
    for (int k = 1; k <= 1000; ++k) profile.emplace_back(1.0 + 0.001 * k, 0.0);
    const auto mesh = extrude(profile, 1.0);
    Species species = narrow();
    species.sticking = {0.75};
    SECTION("what does not stick to flat ground escapes") {
        const FluxResult result = trace(mesh, kPeriodic, species, {.rays = 50'000, .adjoint = true});
        CHECK(result.adjoint);
        for (const double flux : result.triangle.flux) CHECK(flux == Approx(1.0).epsilon(1e-6));
        const auto particles = [](std::uint64_t weight) { return static_cast<double>(weight) * 0x1p-28; };
        CHECK(particles(result.ledger.emitted) == Approx(static_cast<double>(result.emitted)).epsilon(1e-6));
        CHECK(particles(result.ledger.absorbed) ==
              Approx(0.75 * particles(result.ledger.emitted)).epsilon(1e-6));
        // Paths from slivers carry less than a particle each and play Russian roulette.
        CHECK(particles(result.ledger.escaped) ==
              Approx(0.25 * particles(result.ledger.emitted))
                  .margin(5.0 * std::sqrt(0.25 * static_cast<double>(result.emitted))));
        CHECK(result.ledger.balanced());
    }
    SECTION("what they sputter escapes, too") {
        species.sticking = {1.0};
        species.redeposition =
            Redeposition{{"out", Angular::none, 0.0, {30.0}, {}}, Reemission::diffuse, {0.5}};
        const FluxResult result = trace(mesh, kPeriodic, species, {.rays = 50'000, .adjoint = true});
        CHECK(result.redeposited.balanced());
        CHECK(static_cast<double>(result.redeposited.escaped) ==
              Approx(30.0 * static_cast<double>(result.ledger.absorbed)).epsilon(1e-6));
    }
}

TEST_CASE("the error that adjoint paths report is that of the scatter between seeds") {
    const auto mesh = trench();
    const Species species = GENERATE(narrow(), ions());
    const Wedges wedges = make_wedges(mesh);
    constexpr int kSeeds = 64;
    std::vector<Estimate> vertices(mesh.vertices.size());
    double reported = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const FluxResult result =
            trace(mesh, kPeriodic, species, {.rays = 3000, .seed = seed, .adjoint = true});
        reported += result.relative_error / kSeeds;
        for (std::size_t v = 0; v < vertices.size(); ++v) vertices[v].add(result.vertex.flux[v]);
    }
    double error = 0.0, flux = 0.0;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        double area = 0.0;
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) area += wedges.area[w];
        error += area * std::sqrt(vertices[v].variance() * kSeeds);
        flux += area * vertices[v].mean();
    }
    CAPTURE(species.name, reported, error / flux);
    // A trace has only 8 batches, and their paths are stratified over directions, not independent.
    CHECK(reported == Approx(error / flux).epsilon(0.15));
}

TEST_CASE("adjoint paths get the same bits on any number of threads and task sizes, and to a target") {
    const auto mesh = trench();
    const surface::RayScene scene(mesh);
    const LateralBox box = lateral_box(mesh, kPeriodic);
    const Wedges wedges = make_wedges(mesh);
    const Species species = ions();
    const double target = GENERATE(0.0, 0.06, 1e-9);  // no target, one within reach, one beyond
    constexpr std::uint64_t kRays = 100'000;
    const auto run = [&](int threads, std::uint32_t task_rays) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        static_cast<std::size_t>(threads));
        tbb::task_arena arena(threads);
        return arena.execute([&] {
            TraceOptions options{.rays = kRays, .task_rays = task_rays, .adjoint = true};
            if (target > 0.0) options.relative_error = target;
            return trace_flux(mesh, scene, box, species, {}, wedges, options);
        });
    };
    const FluxResult one = run(1, 1024);
    CHECK(one.adjoint);
    CHECK(one.emitted <= kRays);
    CHECK(one.emitted % (3 * mesh.triangles.size()) == 0);
    if (target == 0.06) {
        CHECK(one.largest_error() <= target);
        CHECK(one.emitted < kRays / 2);
    } else {
        CHECK(one.emitted > kRays / 2);
    }
    for (const int threads : {2, 3})
        for (const std::uint32_t task_rays : {1024u, 5000u}) {
            const FluxResult other = run(threads, task_rays);
            for (std::size_t k = 0; k < tally_count(species); ++k) {
                CHECK(one.tally(k).wedge.flux == other.tally(k).wedge.flux);
                CHECK(one.tally(k).wedge.error == other.tally(k).wedge.error);
            }
            CHECK(one.ledger == other.ledger);
            CHECK(one.segments == other.segments);
        }
}

TEST_CASE(
    "what adjoint sampling does not suit starts at the source as ever: broad, tilted or scattered, and with too few rays") {
    const auto mesh = trench();
    CHECK(allows_adjoint(narrow(50.0)));
    CHECK(allows_adjoint(ions()));
    Species desorbing = narrow();
    desorbing.desorbs = true;
    CHECK_FALSE(allows_adjoint(desorbing));
    std::vector<Species> others(4, narrow());
    others[0].source_exponent = 49.0;
    others[1].beam = Vec3(0.6, 0.0, -0.8);
    others[2].mean_free_path = 3.0;
    others[3].bins = {{0.0, 0.01, 0.0, 0.0, 1.0}};
    for (const Species& species : others) {
        CHECK_FALSE(allows_adjoint(species));
        const FluxResult down = trace(mesh, kPeriodic, species, {.rays = 20'000}),
                         up = trace(mesh, kPeriodic, species, {.rays = 20'000, .adjoint = true});
        CHECK(down.wedge.flux == up.wedge.flux);
    }
    const std::uint64_t few = 12 * mesh.triangles.size() - 1;
    CHECK(trace(mesh, kPeriodic, narrow(), {.rays = few}).wedge.flux ==
          trace(mesh, kPeriodic, narrow(), {.rays = few, .adjoint = true}).wedge.flux);
    // Two species that share paths are traced from the source.
    const surface::RayScene scene(mesh);
    const LateralBox box = lateral_box(mesh, kPeriodic);
    const Wedges wedges = make_wedges(mesh);
    std::vector<Species> pair(2, narrow());
    pair[1].sticking = {0.5};
    for (const FluxResult& one :
         trace_fluxes(mesh, scene, box, pair, {}, wedges, {.rays = 20'000, .adjoint = true})) {
        CHECK(one.pass_species == 2);
        CHECK_FALSE(one.adjoint);
    }
}
