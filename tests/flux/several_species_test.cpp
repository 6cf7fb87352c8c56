#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "flux/tracer/packets.hpp"
#include "surface/error.hpp"
#include "tests/flux/flux_checks.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/trench_table.hpp"
#include "tests/flux/truth.hpp"

using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;

namespace {

// A surface with all that a trace of it needs.
struct Place {
    TriangleMesh mesh;
    surface::RayScene scene;
    LateralBox box;
    Wedges wedges;
    Place(TriangleMesh surface, std::array<Boundary, 2> boundary)
        : mesh(std::move(surface)),
          scene(mesh),
          box(lateral_box(mesh, boundary)),
          wedges(make_wedges(mesh)) {}
    std::vector<FluxResult> together(const std::vector<Species>& species, const TraceOptions& options) const {
        return trace_fluxes(mesh, scene, box, species, {}, wedges, options);
    }
    FluxResult alone(const Species& species, const TraceOptions& options) const {
        return trace_flux(mesh, scene, box, species, {}, wedges, options);
    }
    double mean(const FluxResult& result) const {
        return mean_flux(mesh, result, [](std::size_t) { return true; }).flux;
    }
};

Place trench(double depth = 2.0) {
    return {extrude(trench_profile(depth, 0.1, {0.25, 0.5, 0.75}, {0.5}), 0.7, 2), kPeriodic};
}
Place hole() {
    return {round_hole(1.0, 2.0, 1.1, 16, 0.4).mesh, kReflective};
}

std::vector<Species> neutrals(const std::vector<double>& stickings) {
    std::vector<Species> species;
    for (const double s : stickings) species.push_back({"neutral " + std::to_string(s), 1.0, {s}});
    return species;
}

void check_ends(const FluxResult& result) {
    CHECK(result.ledger.balanced());
    CHECK(result.ledger.emitted == result.emitted * kOne);
    CHECK(result.emitted == result.absorbed + result.escaped + result.leaked);
}

void check_same_tallies(const FluxResult& a, const FluxResult& b) {
    for (const auto field : {&TallyFlux::triangle, &TallyFlux::wedge, &TallyFlux::vertex}) {
        CHECK((a.*field).flux == (b.*field).flux);
        CHECK((a.*field).error == (b.*field).error);
    }
    CHECK(a.relative_error == b.relative_error);
    CHECK(a.emitted == b.emitted);
    CHECK(a.absorbed == b.absorbed);
    CHECK(a.escaped == b.escaped);
    CHECK(a.arrivals == b.arrivals);
    CHECK(a.ledger == b.ledger);
}

// Mean over seeds, and its standard error.
struct Sample {
    double sum = 0.0, squares = 0.0;
    int count = 0;
    void add(double x) {
        sum += x;
        squares += x * x;
        ++count;
    }
    double mean() const { return sum / count; }
    double error() const { return std::sqrt((squares / count - mean() * mean()) / (count - 1)); }
};

}  // namespace

TEST_CASE("species traced together have the fluxes and the errors of species traced alone", "[slow]") {
    const auto stickings = GENERATE(std::vector{1.0, 0.3, 0.02}, std::vector{0.3, 0.02});
    const Place place = GENERATE(0, 1) == 0 ? trench() : hole();
    const std::vector<Species> species = neutrals(stickings);
    constexpr int kSeeds = 64;
    const std::size_t triangles = place.mesh.triangles.size(),
                      elements = triangles + place.mesh.vertices.size();
    std::vector<Sample> mean(species.size()), spread(species.size());
    std::vector<std::vector<Sample>> difference(species.size(), std::vector<Sample>(elements));
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const auto shared = place.together(species, {.rays = 32768, .seed = seed});
        for (std::size_t k = 0; k < species.size(); ++k) {
            const FluxResult own = place.alone(species[k], {.rays = 32768, .seed = seed, .time_step = 1});
            mean[k].add(place.mean(shared[k]) - place.mean(own));
            double squares = 0.0, used = 0.0;
            for (std::size_t i = 0; i < elements; ++i) {
                const auto field = i < triangles ? &TallyFlux::triangle : &TallyFlux::vertex;
                const std::size_t e = i < triangles ? i : i - triangles;
                const double d = (shared[k].*field).flux[e] - (own.*field).flux[e];
                const double error = std::hypot((shared[k].*field).error[e], (own.*field).error[e]);
                difference[k][i].add(d);
                if (!(error > 0.0)) continue;
                squares += d * d / (error * error);
                ++used;
            }
            spread[k].add(squares / used);
        }
    }
    for (std::size_t k = 0; k < species.size(); ++k) {
        CAPTURE(species[k].name, mean[k].mean(), mean[k].error(), spread[k].mean(), spread[k].error());
        CHECK(std::abs(mean[k].mean()) < 4.0 * mean[k].error());
        // Mean square of differences in units of their standard errors, from 32 batches each: that of
        // Student's t of 31 to 62 degrees of freedom, more where the two errors are more equal. Elements are
        // correlated, so the scatter between seeds gives the error of their mean.
        CHECK(spread[k].mean() > 62.0 / 60.0 - 4.0 * spread[k].error());
        CHECK(spread[k].mean() < 31.0 / 29.0 + 4.0 * spread[k].error());
        for (std::size_t i = 0; i < elements; ++i) {
            CAPTURE(i, difference[k][i].mean(), difference[k][i].error());
            // About 1000 elements; Student's t of 63 degrees of freedom is beyond 5.5 in 1 of a million.
            CHECK(std::abs(difference[k][i].mean()) <= 5.5 * difference[k][i].error());
        }
    }
}

TEST_CASE("of species traced together, each has the exact flux of an infinite trench", "[slow]") {
    constexpr double kAspect = 2.0;
    const auto mesh = extrude(trench_profile(kAspect, 0.01, kCuts, kCuts), 2.0);
    const auto species = neutrals({1.0, 0.5, 0.1});
    Groups groups;
    std::vector<std::vector<Row>> rows(species.size());
    for (const Row& row : radiosity_rows())
        for (std::size_t k = 0; k < species.size(); ++k)
            if (row.aspect == kAspect && row.sticking == species[k].sticking.front()) {
                rows[k].push_back(row);
                if (k == 0) groups.push_back(triangles_of(mesh, row));
            }
    const auto means =
        over_seeds(mesh, {Boundary::reflective, Boundary::periodic}, species, 12'000'000, 100, groups);
    Comparison comparison;
    for (std::size_t k = 0; k < species.size(); ++k) {
        REQUIRE(rows[k].size() == groups.size());
        const TrenchFlux exact = trench_flux(kAspect, species[k].sticking.front(), 400, 100);
        for (std::size_t i = 0; i < groups.size(); ++i) {
            const Row& row = rows[k][i];
            REQUIRE(row.where == rows[0][i].where);
            REQUIRE(row.position == rows[0][i].position);
            CAPTURE(row.sticking, row.where, row.position);
            comparison.check(means[k][i], exact_mean(exact, row));
        }
    }
    comparison.verdict();
}

TEST_CASE("paths are those of the species that sticks least, which has the bits of a trace of its own") {
    const Place place = trench();
    const auto shared = place.together(neutrals({1.0, 0.3, 0.02}), {.rays = 50'000});
    check_same_tallies(shared[2], place.alone({"alone", 1.0, {0.02}}, {.rays = 50'000}));
    CHECK(shared[0].arrivals < shared[1].arrivals);
    // Both of two equal species have the bits of a trace alone.
    const auto twins = place.together(neutrals({0.3, 0.3}), {.rays = 50'000});
    check_same_tallies(twins[0], twins[1]);
    check_same_tallies(twins[0], place.alone({"alone", 1.0, {0.3}}, {.rays = 50'000}));
    for (std::uint32_t k = 0; k < 3; ++k) {
        CHECK(shared[k].pass_species == 3);
        CHECK(shared[k].pass_place == k);
        CHECK(shared[k].segments == shared[0].segments);
    }
}

TEST_CASE("every species' ledger balances to the last bit, and each of its histories ends once") {
    const double threshold = GENERATE(1.0, 0.5, 0.02);
    const auto stickings = GENERATE(std::vector{1.0, 0.3, 0.02}, std::vector{1.0, 1.0},
                                    std::vector{0.0, 0.7, 1.0}, std::vector{0.999, 0.001, 0.5, 0.2});
    const std::vector<Species> species = neutrals(stickings);
    SECTION("in a deep trench, out of which nothing leaks") {
        for (const FluxResult& result :
             trench(5.0).together(species, {.rays = 100'000, .roulette = threshold})) {
            check_ends(result);
            CHECK(result.leaked == 0);
            CHECK(result.ledger.leaked == 0);
        }
    }
    SECTION("where paths are cut off") {
        const auto results =
            trench(5.0).together(species, {.rays = 20'000, .max_bounces = 2, .roulette = threshold});
        for (std::size_t k = 0; k < species.size(); ++k) {
            check_ends(results[k]);
            CHECK((results[k].leaked > 0) == (stickings[k] < 1.0));
            CHECK((results[k].ledger.leaked > 0) == (stickings[k] < 1.0));
        }
    }
    SECTION("where none is absorbed") {
        const FluxResult none = hole().together(neutrals({0.0, stickings.back()}), {.rays = 20'000})[0];
        check_ends(none);
        CHECK(none.escaped == none.emitted);
        CHECK(none.ledger.escaped == none.ledger.emitted);
    }
}

TEST_CASE("fluxes of several species have the same bits for any number of threads and any task size",
          "[slow]") {
    const Place place = trench(3.0);
    const auto species = neutrals({1.0, 0.3, 0.02});
    constexpr std::uint64_t kRays = 200'000;
    const auto run = [&](int threads, std::uint32_t task_rays, double target) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        static_cast<std::size_t>(threads));
        tbb::task_arena arena(threads);
        return arena.execute([&] {
            TraceOptions options{.rays = kRays, .batches = 16, .task_rays = task_rays};
            if (target > 0.0) options.relative_error = target;
            return place.together(species, options);
        });
    };
    const double target = GENERATE(0.0, 0.03);
    const auto one = run(1, 1024, target);
    for (const std::uint32_t task_rays : {1u, 2500u, 1'000'000u})
        for (const int threads : {1, 2, 3}) {
            const auto other = run(threads, task_rays, target);
            for (std::size_t k = 0; k < species.size(); ++k) {
                CAPTURE(species[k].name, task_rays, threads);
                check_same_tallies(one[k], other[k]);
                CHECK(one[k].segments == other[k].segments);
            }
        }
}

TEST_CASE("tracing several species to a target error goes on until the last is there") {
    const Place place = trench(4.0);
    const auto to = [&](double target, const std::vector<Species>& species, std::uint64_t rays) {
        return place.together(species, {.rays = rays, .relative_error = target});
    };
    const auto species = neutrals({1.0, 0.02});
    const auto results = to(0.02, species, 10'000'000);
    for (const FluxResult& result : results) {
        CHECK(result.relative_error <= 0.02);
        CHECK(result.relative_error > 0.005);  // not traced many times as long as necessary
        check_ends(result);
    }
    CHECK(results[0].emitted != results[1].emitted);  // the one that reaches it first is traced no further
    for (const FluxResult& capped : to(1e-4, species, 20'000)) {
        CHECK(capped.relative_error > 1e-4);
        CHECK(capped.emitted >= 20'000);
        CHECK(capped.emitted < 21'000);
    }
    CHECK_THROWS_AS(to(0.0, species, 1000), RecipeError);
}

TEST_CASE("species traced together stick by wedge, each by its own values") {
    const Place place = trench();
    const std::size_t n = place.wedges.count();
    // The first species sticks equally everywhere, the second more with depth.
    std::vector<double> sticking(2 * n, 0.4);
    for (std::size_t c = 0; c < place.wedges.corner.size(); ++c) {
        const double z = place.mesh.vertices[place.mesh.triangles[c / 3][c % 3]].z();
        sticking[n + place.wedges.corner[c]] = 0.1 - 0.4 * z;
    }
    const auto species = neutrals({0.0, 0.0});  // replaced by sticking_by_wedge
    const std::span<const double> all = sticking;
    std::array<Sample, 2> floor, whole;
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
        const auto shared = place.together(species, {.rays = 16384, .seed = seed, .sticking_by_wedge = all});
        for (std::size_t k = 0; k < 2; ++k) {
            check_ends(shared[k]);
            const auto own =
                k == 0
                    ? place.alone({"alone", 1.0, {0.4}}, {.rays = 16384, .seed = seed, .time_step = 1})
                    : place.alone(
                          species[k],
                          {.rays = 16384, .seed = seed, .time_step = 1, .sticking_by_wedge = all.subspan(n)});
            const auto on_floor = [&](const FluxResult& result) {
                return mean_flux(
                           place.mesh, result,
                           [&](std::size_t t) { return triangle_centroid(place.mesh, t).z() < -2.0 + 1e-9; })
                    .flux;
            };
            floor[k].add(on_floor(shared[k]) - on_floor(own));
            whole[k].add(place.mean(shared[k]) - place.mean(own));
        }
    }
    for (std::size_t k = 0; k < 2; ++k)
        for (const Sample& sample : {floor[k], whole[k]}) {
            CAPTURE(k, sample.mean(), sample.error());
            CHECK(sample.error() < 0.01);
            CHECK(std::abs(sample.mean()) < 4.0 * sample.error());
        }
}

TEST_CASE("only neutrals that differ in nothing but their sticking share paths") {
    const Species plain{"plain", 1.0, {0.3}};
    Species other{"other", 1.0, {1.0, 0.2}};
    CHECK(same_paths(plain, other));
    const auto differs = [&](auto&& change) {
        Species changed = plain;
        change(changed);
        CHECK_FALSE(same_paths(plain, changed));
        CHECK_FALSE(same_paths(changed, plain));
        return changed;
    };
    differs([](Species& s) { s.source_exponent = 2.0; });
    differs([](Species& s) { s.beam = Vec3(0.6, 0.0, -0.8); });
    differs([](Species& s) { s.rotating = true; });
    // Species with a special behaviour at a hit cannot share paths, even with an equal one.
    for (const Species& own : {differs([](Species& s) {
                                   s.energy = {100.0, 10.0};
                               }),
                               differs([](Species& s) { s.reflection.kind = Reemission::specular; }),
                               differs([](Species& s) { s.reflection.to = 1.5; }),
                               differs([](Species& s) { s.yields = {{"yield"}}; }),
                               differs([](Species& s) { s.redeposition = Redeposition{}; }), ion("ion")})
        CHECK_FALSE(same_paths(own, own));
}

TEST_CASE("species that cannot share paths are traced in passes of their own, results in their order") {
    const Place place = trench();
    std::vector<Species> species = neutrals({0.3, 0.1, 0.9, 0.5, 0.7, 0.2});
    species.insert(species.begin() + 1, ion("ion"));
    species[3].source_exponent = 10.0;
    using Passes = std::vector<std::vector<std::size_t>>;
    CHECK(passes_of(species) == Passes{{0, 2, 4, 5}, {1}, {3}, {6}});
    CHECK(passes_of({}).empty());
    CHECK(place.together({}, {}).empty());
    double last = 0.0;
    TraceOptions options{.rays = 20'000, .species_index = 5};
    options.progress = [&](double part) {
        CHECK(part >= last);
        CHECK(part <= 1.0);
        last = part;
    };
    const auto results = place.together(species, options);
    CHECK(last > 0.95);
    REQUIRE(results.size() == species.size());
    // Species alone in a pass have the bits of a trace alone; in the first pass its least sticking one has.
    for (const std::uint32_t k : {1u, 3u, 6u}) {
        check_same_tallies(results[k], place.alone(species[k], {.rays = 20'000, .species_index = 5 + k}));
        CHECK(results[k].pass_species == 1);
    }
    check_same_tallies(results[2], place.alone(species[2], {.rays = 20'000, .species_index = 5}));
    CHECK(results[5].pass_species == 4);
    CHECK(results[5].pass_place == 3);
}

TEST_CASE("a wrong number of stickings by wedge is refused, and one out of range by its species' name") {
    const Place place = trench();
    const std::size_t n = place.wedges.count();
    std::vector<double> sticking(n, 0.5);
    const auto run = [&] { place.together(neutrals({0.3, 0.1}), {.sticking_by_wedge = sticking}); };
    CHECK_THROWS_AS(run(), GeometryError);
    CHECK_THROWS_WITH(run(), Contains(std::to_string(n) + " sticking probabilities for 2 species on " +
                                      std::to_string(n) + " wedges"));
    sticking.assign(2 * n, 0.5);
    sticking.back() = 1.5;
    CHECK_THROWS_AS(run(), RecipeError);
    CHECK_THROWS_WITH(run(), Contains("neutral 0.100000: sticking of a wedge = 1.5"));
}
