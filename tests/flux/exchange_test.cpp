#include <tbb/global_control.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "flux/radiosity/method_choice.hpp"
#include "surface/error.hpp"
#include "tests/flux/cavity.hpp"
#include "tests/flux/extracted.hpp"
#include "tests/flux/flux_checks.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/truth.hpp"

// Radiosity: fluxes from rays between points of the surface.

using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;

namespace {

std::vector<double> even(std::size_t parts) {
    std::vector<double> cuts;
    for (std::size_t k = 1; k < parts; ++k)
        cuts.push_back(static_cast<double>(k) / static_cast<double>(parts));
    return cuts;
}

constexpr std::array kOpen{Boundary::open, Boundary::open};

// A trench of width 1 along y.
TriangleMesh trench(double depth, double length, std::size_t rows) {
    return extrude(trench_profile(depth, 0.5, even(static_cast<std::size_t>(16 * depth)), even(16)), length,
                   rows);
}

// A round hole of radius 1 in rings of \p facets: a polygon with the area of the circle.
TriangleMesh ringed_hole(double depth, std::size_t facets, std::size_t rings, double half_side = 1.5) {
    const TriangleMesh coarse = round_hole(1.0, depth, half_side, facets, 0.5).mesh;
    const auto n = static_cast<std::uint32_t>(facets);
    TriangleMesh mesh;
    mesh.vertices.assign(coarse.vertices.begin(), coarse.vertices.begin() + 2 * n);
    const auto join = [&](std::uint32_t above, std::uint32_t below) {
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t next = (i + 1) % n;
            mesh.triangles.push_back({above + i, above + next, below + next});
            mesh.triangles.push_back({above + i, below + next, below + i});
        }
    };
    join(0, n);
    std::uint32_t last = n;
    const auto add_ring = [&](double scale, double z) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (std::uint32_t i = 0; i < n; ++i) {
            const Vec3& p = coarse.vertices[n + i];
            mesh.vertices.emplace_back(scale * p.x(), scale * p.y(), z);
        }
        join(last, first);
        last = first;
    };
    for (std::size_t k = 1; k <= rings; ++k)
        add_ring(1.0, -depth * static_cast<double>(k) / static_cast<double>(rings));
    for (const double scale : {0.8, 0.6, 0.4, 0.2}) add_ring(scale, -depth);
    mesh.vertices.emplace_back(0.0, 0.0, -depth);
    const auto centre = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    for (std::uint32_t i = 0; i < n; ++i) mesh.triangles.push_back({last + i, last + (i + 1) % n, centre});
    return mesh;
}

// A profile whose segments are cut into parts no longer than \p length, at least one.
Profile refined(const Profile& profile, double length) {
    Profile fine{profile.front()};
    for (std::size_t i = 1; i < profile.size(); ++i) {
        const auto [x0, z0] = profile[i - 1];
        const auto [x1, z1] = profile[i];
        const int parts = std::max(1, static_cast<int>(std::ceil(std::hypot(x1 - x0, z1 - z0) / length)));
        for (int k = 1; k <= parts; ++k)
            fine.emplace_back(x0 + (x1 - x0) * k / parts, z0 + (z1 - z0) * k / parts);
    }
    return fine;
}

using Where = std::function<bool(const Vec3&)>;

// Area-weighted mean over the triangles whose centroid is chosen.
double mean_of(const TriangleMesh& mesh, const TallyFlux& flux, const Where& chosen) {
    double sum = 0.0, area = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!chosen(triangle_centroid(mesh, t))) continue;
        const double a = triangle_area(mesh, t);
        sum += a * flux.triangle.flux[t];
        area += a;
    }
    return sum / area;
}

struct Scatter {
    double mean = 0.0, error = 0.0;
};

Scatter scatter_of(const std::vector<double>& values) {
    const auto count = static_cast<double>(values.size());
    Scatter s;
    for (const double value : values) s.mean += value / count;
    for (const double value : values) s.error += (value - s.mean) * (value - s.mean);
    s.error = std::sqrt(s.error / (count * (count - 1.0)));
    return s;
}

// Mean over independent exchanges, and its standard error.
Scatter over_exchanges(const Cavity& cavity, std::uint64_t rays_of_unknown, int count,
                       const DiffuseSpecies& species, const Where& chosen) {
    std::vector<double> values;
    for (int k = 0; k < count; ++k) {
        const Exchange exchange =
            cavity.gathered(rays_of_unknown, 100 + static_cast<std::uint64_t>(k), {species.source_exponent});
        values.push_back(mean_of(cavity.mesh, solve_flux(exchange, species), chosen));
    }
    return scatter_of(values);
}

}  // namespace

TEST_CASE("radiosity without sticking is 1 everywhere, however few the rays") {
    const auto boundary = GENERATE(kReflective, kPeriodic);
    const Cavity cavity(trench(5.0, 0.25, 4), boundary);
    const Exchange exchange = cavity.gathered(8);
    const std::vector<double> sticking(cavity.wedges.count(), 0.0);
    const RadiosityFlux flux = solve_flux(exchange, {.sticking = sticking}, {.tolerance = 1e-9});
    for (const double value : flux.wedge.flux) CHECK(value == Approx(1.0).epsilon(1e-6));
    CHECK(flux.escaped == 1.0);
}

TEST_CASE("radiosity of an open plane is 1 where its sticking varies") {
    const Cavity cavity(height_field(12, 12, 3.0, 3.0, [](auto, auto) { return 0.0; }), kReflective);
    const Exchange exchange = cavity.gathered(64);
    const auto furthest = [&](auto&& sticking_at) {
        std::vector<double> sticking(cavity.wedges.count());
        for (std::size_t v = 0; v < cavity.mesh.vertices.size(); ++v)
            for (std::uint32_t w = cavity.wedges.first[v]; w < cavity.wedges.first[v + 1]; ++w)
                sticking[w] = sticking_at(cavity.mesh.vertices[v]);
        double most = 0.0;
        for (const double flux : solve_flux(exchange, {.sticking = sticking}).wedge.flux)
            most = std::max(most, std::abs(flux - 1.0));
        return most;
    };
    const double noise = furthest([](const Vec3&) { return 0.5; });
    const double left = cavity.box.min[0], width = cavity.box.max[0] - left;
    // Linear elements err by the square of the relative change of 1 - s over an edge.
    const double slope = furthest([&](const Vec3& p) { return 0.2 + 0.6 * (p.x() - left) / width; });
    const double steps = furthest([&](const Vec3& p) { return p.x() < left + 0.5 * width ? 0.5 : 0.6; });
    CAPTURE(noise, slope, steps);
    CHECK(slope < noise + 0.05);  // (0.05 / 0.2)^2, at most
    CHECK(steps < noise + 0.05);  // (0.1 / 0.4)^2
}

TEST_CASE("radiosity in a trench agrees with the exact one, whatever the sides and how thin the domain",
          "[slow]") {
    const auto [sticking, boundary, length] =
        GENERATE(table<double, std::array<Boundary, 2>, double>({{1.0, kReflective, 0.25},
                                                                 {0.1, kPeriodic, 0.125},
                                                                 {0.01, kReflective, 0.5},
                                                                 {1.0, kProfile, 0.05},
                                                                 {0.1, kProfile, 2.0},
                                                                 {0.01, kProfile, 0.05}}));
    const auto rows = boundary == kProfile ? 1.0 : 16.0 * length;
    const Cavity cavity(trench(2.0, length, static_cast<std::size_t>(rows)), boundary);
    const TrenchFlux exact = trench_flux(2.0, sticking, 400, 200);
    const std::vector<double> everywhere(cavity.wedges.count(), sticking);
    const DiffuseSpecies species{.sticking = everywhere};
    const Where floor = [](const Vec3& p) { return p.z() < -1.99999; };
    const Where wall = [](const Vec3& p) { return p.z() < 0.0 && p.z() > -1.99999; };
    CAPTURE(sticking, length);
    for (const auto& [where, truth] : {std::pair(floor, exact.floor_mean), {wall, exact.wall_mean}}) {
        const Scatter s = over_exchanges(cavity, 96, 6, species, where);
        CAPTURE(s.mean, truth, s.error);
        // Student's t of 5 degrees of freedom exceeds 4.8 in 1 of 200; linear elements of 1/16 err by 0.3 %.
        CHECK(std::abs(s.mean - truth) < 4.8 * s.error + 0.003 * truth);
        CHECK(s.error < 0.02 * truth);
    }
}

TEST_CASE("radiosity and the tracer agree for every source and behind open sides", "[slow]") {
    const auto [exponent, sides] = GENERATE(table<double, std::array<Boundary, 2>>({{0.0, kReflective},
                                                                                    {1.0, kOpen},
                                                                                    {20.0, kOpen},
                                                                                    {1000.0, kReflective},
                                                                                    {0.0, kProfile},
                                                                                    {20.0, kProfile},
                                                                                    {1000.0, kProfile}}));
    const Cavity cavity(trench(3.0, 1.0, sides == kProfile ? 1 : 6), sides);
    const double sticking = 0.2;
    const std::vector<double> everywhere(cavity.wedges.count(), sticking);
    CAPTURE(exponent, sides == kOpen, sides == kProfile);
    const Species species{"test", exponent, {sticking}};
    for (const double low : {-1.0, -2.0, -3.1}) {
        const Where chosen = [low](const Vec3& p) { return p.z() > low && p.z() < low + 0.99; };
        Groups groups(1);
        for (std::size_t t = 0; t < cavity.mesh.triangles.size(); ++t)
            if (chosen(triangle_centroid(cavity.mesh, t))) groups[0].push_back(t);
        const Mean traced = over_seeds(cavity.mesh, sides, species, 250'000, 7, groups).front();
        const Scatter s =
            over_exchanges(cavity, 64, 6, {.source_exponent = exponent, .sticking = everywhere}, chosen);
        CAPTURE(low, s.mean, s.error, traced.flux, traced.error);
        CHECK(std::abs(s.mean - traced.flux) < 4.8 * std::hypot(s.error, traced.error) + 0.005 * traced.flux);
    }
}

TEST_CASE("radiosity passes Clausing's share of molecules through a tube within 0.5 %", "[slow]") {
    const double length = GENERATE(1.0, 2.0, 4.0);
    const auto rings = static_cast<std::size_t>(10.0 * length);
    TriangleMesh mesh = ringed_hole(length, 64, rings);
    std::vector<std::int32_t> materials;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        materials.push_back(triangle_centroid(mesh, t).z() < -length + 1e-9 ? 1 : 0);
    const Cavity cavity(std::move(mesh), kReflective, materials);
    const std::vector<double> sticking = cavity.sticking({0.0, 1.0});
    const Where floor = [length](const Vec3& p) { return p.z() < -length + 1e-9; };
    const Scatter s = over_exchanges(cavity, 100, 6, {.sticking = sticking}, floor);
    const double truth = clausing_transmission(length);
    CAPTURE(length, s.mean, s.error, truth);
    CHECK(s.error < 0.0015 * truth);  // three standard errors are within 0.5 %
    CHECK(std::abs(s.mean - truth) < 0.005 * truth);
}

TEST_CASE("what starts on the surface is an emission term of radiosity") {
    const double depth = 2.0, sticking = 0.3;
    const Cavity cavity(trench(depth, 0.5, 8), kReflective);
    const TrenchFlux exact = trench_flux(depth, sticking, 400, 200, Emitter::floor);
    const std::vector<double> everywhere(cavity.wedges.count(), sticking);
    std::vector<double> emission(cavity.wedges.count(), 0.0);
    for (std::size_t t = 0; t < cavity.mesh.triangles.size(); ++t)
        if (triangle_centroid(cavity.mesh, t).z() < -depth + 1e-9)
            for (std::size_t k = 0; k < 3; ++k) emission[cavity.wedges.corner[3 * t + k]] = 1.0;
    const DiffuseSpecies species{.source = 0.0, .sticking = everywhere, .emission = emission};
    const Where floor = [&](const Vec3& p) { return p.z() < -depth + 1e-9; };
    const Where wall = [&](const Vec3& p) { return p.z() < 0.0 && !floor(p); };
    for (const auto& [where, truth] : {std::pair(floor, exact.floor_mean), {wall, exact.wall_mean}}) {
        const Scatter s = over_exchanges(cavity, 128, 6, species, where);
        CAPTURE(s.mean, s.error, truth);
        CHECK(std::abs(s.mean - truth) < 4.8 * s.error + 0.005 * truth);
    }
    const RadiosityFlux flux = solve_flux(cavity.gathered(64), species);
    CHECK(flux.absorbed + flux.escaped == Approx(1.0));
    CHECK(flux.absorbed > 0.5);  // most of what the floor emits sticks
}

// A slot of width 1 and depth 5 with an arm of height 1 on each side, 3 and 2 long, hidden from the source.
// `places` are the ends of its arms and its floor.
struct Arms {
    static constexpr double kSticking = 0.05;
    Cavity cavity{extrude(refined({{-4.0, 0.0},
                                   {-0.5, 0.0},
                                   {-0.5, -1.5},
                                   {-3.5, -1.5},
                                   {-3.5, -2.5},
                                   {-0.5, -2.5},
                                   {-0.5, -5.0},
                                   {0.5, -5.0},
                                   {0.5, -4.0},
                                   {2.5, -4.0},
                                   {2.5, -3.0},
                                   {0.5, -3.0},
                                   {0.5, 0.0},
                                   {4.0, 0.0}},
                                  0.1),
                          0.5, 5),
                  kReflective};
    std::vector<Where> places{[](const Vec3& p) { return p.x() < -2.5 && p.z() < -1.0; },
                              [](const Vec3& p) { return p.x() > 1.5 && p.z() < -2.0; },
                              [](const Vec3& p) { return p.z() < -4.9999; }};
    // The tracer's means at `places`, from 1e9 rays.
    static constexpr std::array<Mean, 3> kTraced{
        {{0.3133027, 8.85e-5}, {0.2922260, 7.34e-5}, {0.4311369, 7.15e-5}}};

    std::vector<Mean> traced(std::uint64_t rays, std::uint32_t stream) const {
        Groups groups(places.size());
        for (std::size_t t = 0; t < cavity.mesh.triangles.size(); ++t)
            for (std::size_t k = 0; k < places.size(); ++k)
                if (places[k](triangle_centroid(cavity.mesh, t))) groups[k].push_back(t);
        return over_seeds(cavity.mesh, kReflective, {"test", 1.0, {kSticking}}, rays, stream, groups);
    }
};

TEST_CASE("radiosity in the arms of a branched, re-entrant cavity agrees with 1e9 rays from above") {
    const Arms arms;
    const std::vector<double> everywhere(arms.cavity.wedges.count(), Arms::kSticking);
    for (std::size_t k = 0; k < arms.places.size(); ++k) {
        const Scatter s = over_exchanges(arms.cavity, 128, 8, {.sticking = everywhere}, arms.places[k]);
        const Mean& traced = Arms::kTraced[k];
        CAPTURE(k, s.mean, s.error, traced.flux, traced.error);
        CHECK(s.error < 0.003 * s.mean);
        constexpr double kElements = 0.0025;  // well within the 1 % required
        CHECK(std::abs(s.mean - traced.flux) <
              3.0 * std::hypot(s.error, traced.error) + kElements * traced.flux);
    }
}

// Takes three minutes on two cores.
TEST_CASE("what 1e9 rays tell of the arms is what the tests have of them", "[.long]") {
    const auto traced = Arms().traced(1'000'000'000, 3);
    for (std::size_t k = 0; k < traced.size(); ++k) {
        CAPTURE(k, traced[k].flux, traced[k].error);
        CHECK(traced[k].flux == Approx(Arms::kTraced[k].flux).epsilon(1e-4));
        CHECK(traced[k].error == Approx(Arms::kTraced[k].error).epsilon(0.05));
    }
}

TEST_CASE("fewer rays tell the same of the arms") {
    const auto traced = Arms().traced(2'000'000, 4);
    for (std::size_t k = 0; k < traced.size(); ++k) {
        CAPTURE(k, traced[k].flux, traced[k].error);
        CHECK(std::abs(traced[k].flux - Arms::kTraced[k].flux) <
              3.5 * std::hypot(traced[k].error, Arms::kTraced[k].error));
    }
}

TEST_CASE("a hole four times as deep takes the solver hardly more iterations") {
    const auto iterations = [](double depth, int rings) {
        const Cavity cavity(ringed_hole(depth, 16, rings), kReflective);
        const std::vector<double> sticking(cavity.wedges.count(), 1e-3);
        return solve_flux(cavity.gathered(64), {.sticking = sticking}).iterations;
    };
    // Without the solver's coarse grid the iterations grow with the depth.
    const std::uint32_t shallow = iterations(40.0, 40), deep = iterations(160.0, 160);
    CAPTURE(shallow, deep);
    CHECK(deep < 2 * shallow);
}

TEST_CASE("a nearly closed cavity at sticking 1e-6 holds the flux that its opening and walls balance") {
    // A box of width 20 and height 4 whose lid has a slit of width 0.2: particles bounce thousands of times.
    const Profile profile{{-10.5, 0.0}, {-0.1, 0.0},  {-0.1, -0.2}, {-10.0, -0.2}, {-10.0, -4.2},
                          {10.0, -4.2}, {10.0, -0.2}, {0.1, -0.2},  {0.1, 0.0},    {10.5, 0.0}};
    const Cavity cavity(extrude(refined(profile, 1.0), 2.0, 2), kReflective);
    const std::vector<double> sticking(cavity.wedges.count(), 1e-6);
    const RadiosityFlux flux = solve_flux(cavity.gathered(64), {.sticking = sticking}, {.tolerance = 1e-9});
    // The walls, 68 long, absorb 68e-6 and the slit, 0.2 wide, lets particles in and out: the flux is 1 -
    // 3.4e-4, less what the slit's own walls return.
    for (std::size_t t = 0; t < cavity.mesh.triangles.size(); ++t) {
        CHECK(flux.triangle.flux[t] <= 1.0 + 1e-6);
        CHECK(flux.triangle.flux[t] > 0.998);
    }
    CHECK(flux.iterations < 400);
}

TEST_CASE("radiosity's solver goes on until the faintest flux has settled, and that where all sticks") {
    // Aspect ratio 40: where what the walls pass down meets what flies straight down, the flux is 1e-5 of the
    // mouth's.
    const Cavity cavity(ringed_hole(80.0, 16, 60), kReflective);
    const Exchange exchange = cavity.gathered(32);
    std::vector<double> sticking(cavity.wedges.count(), 0.05);
    const auto furthest = [&] {
        const RadiosityFlux flux = solve_flux(exchange, {.sticking = sticking}, {.errors = false}),
                            settled = solve_flux(exchange, {.sticking = sticking},
                                                 {.tolerance = 1e-12, .errors = false});
        double most = 0.0;
        for (std::size_t w = 0; w < sticking.size(); ++w)
            most = std::max(most, std::abs(flux.wedge.flux[w] / settled.wedge.flux[w] - 1.0));
        return most;
    };
    // A relaxation that changes the mean over 1000 unknowns by 1e-5 changes one of them by at most 0.01.
    CHECK(furthest() < 0.01);
    std::fill(sticking.begin(), sticking.begin() + static_cast<std::ptrdiff_t>(sticking.size() / 2), 1.0);
    CHECK(furthest() < 0.01);
}

TEST_CASE("standard errors of radiosity are those that other seeds show") {
    const Cavity cavity(ringed_hole(10.0, 16, 20), kReflective);
    const std::vector<double> sticking(cavity.wedges.count(), 0.05);
    constexpr int kSeeds = 12;
    std::vector<RadiosityFlux> runs;
    for (int k = 0; k < kSeeds; ++k)
        runs.push_back(
            solve_flux(cavity.gathered(64, 50 + static_cast<std::uint64_t>(k)), {.sticking = sticking}));
    double seen = 0.0, told = 0.0;
    for (std::size_t t = 0; t < cavity.mesh.triangles.size(); ++t) {
        double mean = 0.0, squares = 0.0;
        for (const RadiosityFlux& run : runs) mean += run.triangle.flux[t] / kSeeds;
        for (const RadiosityFlux& run : runs)
            squares += std::pow(run.triangle.flux[t] - mean, 2.0) / (kSeeds - 1);
        for (const RadiosityFlux& run : runs)
            told += std::pow(run.triangle.error[t], 2.0) / kSeeds / mean / mean;
        seen += squares / mean / mean;
    }
    // Errors come from groups of an eighth of the rays, each of which errs by a little more than its share.
    CAPTURE(std::sqrt(seen), std::sqrt(told));
    CHECK(told > 0.7 * seen);
    CHECK(told < 3.0 * seen);
}

TEST_CASE("radiosity has the same bits on any number of threads, and gathers that add up") {
    const Cavity cavity(ringed_hole(4.0, 16, 10), kReflective);
    const std::vector<double> sticking(cavity.wedges.count(), 0.1);
    const auto solved = [&](std::size_t threads) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        Exchange exchange = cavity.gathered(16);
        exchange.gather(32 * cavity.wedges.count());
        return std::pair(solve_flux(exchange, {.sticking = sticking}), exchange.rays());
    };
    const auto [one, rays] = solved(1);
    const auto [four, same] = solved(4);
    CHECK(one.wedge.flux == four.wedge.flux);
    CHECK(one.wedge.error == four.wedge.error);
    CHECK(one.discretisation_error > 0.0);
    CHECK(one.relative_error == four.relative_error);
    CHECK(rays == same);
    CHECK(rays == Approx(48.0 * static_cast<double>(cavity.wedges.count())).epsilon(0.01));
}

TEST_CASE("radiosity adds rays until its relative error is met, and solving traces none") {
    const Cavity cavity(ringed_hole(6.0, 16, 12), kReflective);
    const std::vector<double> low(cavity.wedges.count(), 0.01), high(cavity.wedges.count(), 0.3);
    const std::vector<DiffuseSpecies> species{{.name = "low", .sticking = low},
                                              {.name = "high", .sticking = high}};
    Exchange exchange(cavity.mesh, cavity.scene, cavity.box, cavity.wedges, {1.0});
    const auto fluxes = solve_fluxes_to(std::vector{0.05, 0.03}, exchange, species, 100'000'000);
    CHECK(fluxes[0].relative_error <= 0.05);
    CHECK(fluxes[1].relative_error <= 0.03);
    const std::uint64_t rays = exchange.rays(), segments = exchange.segments();
    solve_flux(exchange, {.sticking = low, .guess = fluxes[0].wedge.flux});
    CHECK(exchange.rays() == rays);
    CHECK(exchange.segments() == segments);
    // Allowed no more rays, the solver reports an error above the target.
    const auto short_of = solve_fluxes_to(std::vector{1e-4, 1e-4}, exchange, species, rays);
    CHECK(exchange.rays() == rays);
    CHECK(short_of[1].relative_error > 1e-4);
}

TEST_CASE("rays that start where adjoint solutions say they count give the exact flux") {
    const auto [boundary, rows] =
        GENERATE(table<std::array<Boundary, 2>, std::size_t>({{kReflective, 4}, {kProfile, 1}}));
    const double depth = 5.0, sticking = 0.1;
    const Cavity cavity(trench(depth, 0.25, rows), boundary);
    const TrenchFlux exact = trench_flux(depth, sticking, 400, 200);
    const std::vector<double> everywhere(cavity.wedges.count(), sticking);
    const DiffuseSpecies species{.sticking = everywhere};
    const Where floor = [&](const Vec3& p) { return p.z() < -depth + 1e-5; };
    const Where wall = [&](const Vec3& p) { return p.z() < 0.0 && !floor(p); };
    for (const auto& [where, truth] : {std::pair(floor, exact.floor_mean), {wall, exact.wall_mean}}) {
        constexpr int kSeeds = 6;
        std::vector<double> values;
        for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
            Exchange exchange(cavity.mesh, cavity.scene, cavity.box, cavity.wedges, {1.0}, {.seed = seed});
            gather_for({&species, 1}, exchange, 96 * exchange.unknowns());
            CHECK(exchange.has_importance());
            values.push_back(mean_of(cavity.mesh, solve_flux(exchange, species), where));
        }
        const Scatter s = scatter_of(values);
        CAPTURE(s.mean, truth, s.error, rows);
        // Bounds as for evenly started rays: Student's t, and 0.3 % for linear elements.
        CHECK(std::abs(s.mean - truth) < 4.8 * s.error + 0.003 * truth);
        CHECK(s.error < 0.05 * truth);
    }
}

TEST_CASE("a good guess saves radiosity iterations") {
    const Cavity cavity(ringed_hole(10.0, 16, 20), kReflective);
    const Exchange exchange = cavity.gathered(32);
    const std::vector<double> sticking(cavity.wedges.count(), 0.02);
    const RadiosityFlux cold =
        solve_flux(exchange, {.sticking = sticking}, {.errors = false, .unbiased = false});
    const RadiosityFlux warm = solve_flux(exchange, {.sticking = sticking, .guess = cold.wedge.flux},
                                          {.errors = false, .unbiased = false});
    CHECK(cold.iterations > 8);
    CHECK(warm.iterations <= 1);
    for (std::size_t w = 0; w < cavity.wedges.count(); ++w)
        CHECK(warm.wedge.flux[w] == Approx(cold.wedge.flux[w]).epsilon(1e-4));
}

TEST_CASE("radiosity refuses what it cannot do and says why") {
    const Cavity cavity(trench(1.0, 0.5, 2), kReflective);
    Exchange exchange(cavity.mesh, cavity.scene, cavity.box, cavity.wedges, {1.0}, {.most_bytes = 1'000'000});
    const std::vector<double> sticking(cavity.wedges.count(), 0.1), wrong(3, 0.1),
        above(cavity.wedges.count(), 1.5);
    CHECK_THROWS_WITH(solve_flux(exchange, {.sticking = sticking}), Contains("no rays"));
    CHECK_THROWS_WITH(exchange.gather(1'000'000), Contains("GB allowed"));
    CHECK(exchange.rays() == 0);
    exchange.gather(10'000);
    std::uint64_t bytes = 0;
    for (const SampleGroup& group : exchange.state().groups)
        bytes += group.pairs.capacity() * sizeof(PairSample) + group.exits.capacity() * sizeof(ExitSample);
    CHECK(bytes <= exchange_bytes(exchange.rays()));
    CHECK_THROWS_AS(solve_flux(exchange, {.sticking = wrong}), GeometryError);
    CHECK_THROWS_WITH(solve_flux(exchange, {.sticking = above}), Contains("must be in [0, 1]"));
    CHECK_THROWS_WITH(solve_flux(exchange, {.source_exponent = 2.0, .sticking = sticking}),
                      Contains("source exponent 2"));
    CHECK_THROWS_WITH(solve_flux(exchange, {.sticking = sticking}, {.most_iterations = 1}),
                      Contains("after 1 iterations"));
    CHECK_THROWS_AS(solve_flux(exchange, {.sticking = sticking}, {.stop = [] { return true; }}), Interrupted);
    CHECK(why_not_radiosity({}).empty());
    CHECK_THAT(why_not_radiosity(ion("ion")), Contains("energy"));
    Species mirrored;
    mirrored.reflection.kind = Reemission::specular;
    CHECK_THAT(why_not_radiosity(mirrored), Contains("diffusely"));
    Exchange stopped(cavity.mesh, cavity.scene, cavity.box, cavity.wedges, {1.0},
                     {.stop = [] { return true; }});
    CHECK_THROWS_AS(stopped.gather(10'000), Interrupted);
}

TEST_CASE("auto takes radiosity for deep holes at low sticking and the tracer for open surfaces") {
    const auto chosen = [](const Cavity& cavity, double sticking) {
        Exchange exchange = cavity.gathered(0);
        return choose_method(exchange, {"test", 1.0, {sticking}}, {}, {.relative_error = 0.02});
    };
    const MethodChoice deep = chosen(Cavity(ringed_hole(40.0, 16, 80), kReflective), 0.01);
    CHECK(deep.radiosity);
    CHECK(deep.why_not.empty());
    CHECK_FALSE(chosen(Cavity(trench(0.5, 0.5, 8), kReflective), 1.0).radiosity);
    const Cavity cavity(trench(0.5, 0.5, 8), kReflective);
    Exchange exchange = cavity.gathered(0);
    CHECK_FALSE(choose_method(exchange, ion("ion"), {}, {.relative_error = 0.02}).why_not.empty());
}

TEST_CASE("rays gathered to choose a method are gone on with") {
    const Cavity cavity(extracted_trench(2.0), kReflective);
    const std::vector<double> everywhere(cavity.wedges.count(), 0.1);
    const DiffuseSpecies species{.sticking = everywhere};
    const auto choose = [](Exchange& exchange, double target, std::uint64_t rays, double sticking = 0.1) {
        return choose_method(exchange, {"test", 1.0, {sticking}}, {},
                             {.rays = rays, .relative_error = target});
    };
    constexpr std::uint64_t kMany = 1'000'000'000;
    // Each group's share of the rays is rounded.
    const auto about = [](std::uint64_t rays) { return Approx(static_cast<double>(rays)).epsilon(0.01); };
    Exchange exchange = cavity.gathered(0);
    const std::uint64_t fewest = exchange.fewest_rays();
    CHECK_FALSE(choose(exchange, 0.5, kMany).radiosity);
    CHECK_FALSE(choose(exchange, 0.01, fewest - 1).radiosity);  // the first rays alone are too many
    CHECK(exchange.rays() == 0);

    const MethodChoice close = choose(exchange, 0.01, kMany);
    CHECK(close.radiosity);
    CHECK(close.guess.size() == cavity.wedges.count());
    CHECK(static_cast<double>(exchange.rays()) == about(fewest));
    CHECK(close.spent > 0.0);
    CHECK(close.radiosity_cost > close.spent);
    const std::uint64_t before = exchange.rays();
    // Where little sticks, the first rays leave a small error.
    const std::vector<double> little(cavity.wedges.count(), 0.01);
    const double reached = 1.05 * solve_flux(exchange, {.sticking = little}).relative_error;
    const MethodChoice rough = choose(exchange, reached, kMany, 0.01);
    CHECK(exchange.rays() == before);
    CHECK(rough.radiosity);
    CHECK(rough.radiosity_cost == rough.spent);

    const auto needed = static_cast<std::uint64_t>(close.rays * static_cast<double>(exchange.unknowns()));
    gather_for({&species, 1}, exchange, needed);
    CHECK(exchange.has_importance());
    CHECK(static_cast<double>(exchange.rays()) == about(needed));
    // The rays are as many as the target takes, and a tenth more.
    const double left = solve_flux(exchange, species).relative_error;
    CAPTURE(left);
    CHECK(left < 0.01);
    CHECK(left > 0.008);
}

TEST_CASE("a flux by auto takes the first rays if they do, and no more rays than allowed") {
    const Cavity cavity(extracted_trench(2.0), kReflective);
    const auto found = [&](double error, std::uint64_t rays, double sticking = 0.1) {
        const Species species{"test", 1.0, {sticking}};
        const SingleFlux asked{cavity.mesh,
                               {},
                               cavity.box,
                               cavity.wedges,
                               cavity.scene,
                               species,
                               {.rays = rays, .relative_error = error}};
        Exchange exchange = exchange_of(asked);
        const MethodChoice choice = choose_method(exchange, species, {}, asked.options, true);
        CHECK(choice.radiosity);
        const RadiosityFlux flux = solve(asked, choice, exchange);
        return std::pair(flux.relative_error, exchange.rays());
    };
    constexpr std::uint64_t kMany = 1'000'000'000;
    const auto fewest = cavity.gathered(0).fewest_rays();
    const auto [error, rays] = found(0.02, kMany);
    CHECK(error <= 0.02);
    CHECK(error > 0.016);
    CHECK(rays > 4 * fewest);
    CHECK(found(0.001, 3 * fewest).second <= 3 * fewest);
    // Where little sticks, the first rays leave a small error.
    const std::vector<double> little(cavity.wedges.count(), 0.01);
    const double reached = 1.3 * solve_flux(cavity.gathered(12), {.sticking = little}).relative_error;
    const auto [least, first] = found(reached, kMany, 0.01);
    CHECK(least <= reached);
    CHECK(static_cast<double>(first) == Approx(static_cast<double>(fewest)).epsilon(0.01));
}
