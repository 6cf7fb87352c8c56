#include "tests/flux/truth.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "flux/tracer/packets.hpp"
#include "tests/flux/flux_checks.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

void check_ledger(const FluxResult& result) {
    CHECK(result.leaked == 0);
    CHECK(result.emitted == result.absorbed + result.escaped + result.leaked);
    CHECK(result.ledger.balanced());
    CHECK(result.ledger.emitted == result.emitted * kOne);
    CHECK(result.ledger.leaked == 0);
}

}  // namespace

TEST_CASE("the quadratures that tests compare with have converged") {
    // Clausing (1932), as tabulated by Cole, Prog. Astronaut. Aeronaut. 51 (1977) 261.
    for (const auto& [length, value] : {std::pair(0.5, 0.80127),
                                        {1.0, 0.67198},
                                        {2.0, 0.51423},
                                        {4.0, 0.35657},
                                        {10.0, 0.19094},
                                        {20.0, 0.10931}})
        CHECK(clausing_transmission(length) == Approx(value).margin(1.1e-5));
    CHECK(clausing_transmission(20.0, 400, 0.001) ==
          Approx(clausing_transmission(20.0, 800, 0.001)).epsilon(1e-4));
    const TrenchFlux coarse = trench_flux(10.0, 0.001, 100, 30), fine = trench_flux(10.0, 0.001, 200, 60);
    CHECK(coarse.wall_mean == Approx(fine.wall_mean).epsilon(1e-4));
    CHECK(coarse.floor_mean == Approx(fine.floor_mean).epsilon(1e-4));
}

TEST_CASE("a cylinder transmits what Clausing's integral equation says, for any length", "[slow]") {
    const auto [length, rays] = GENERATE(table<double, std::uint64_t>({{0.5, 500'000},
                                                                       {1.0, 500'000},
                                                                       {2.0, 1'000'000},
                                                                       {4.0, 1'000'000},
                                                                       {10.0, 2'000'000},
                                                                       {20.0, 3'000'000}}));
    const double truth = clausing_transmission(length);
    const auto hole = round_hole(1.0, length, 1.02, 64, 0.5);
    const auto result =
        trace(hole.mesh, kReflective, {"test", 1.0, {1.0, 0.0, 1.0, 1.0}}, {.rays = rays}, hole.materials);
    check_ledger(result);
    const Mean floor = mean_flux(hole.mesh, result, [&](std::size_t t) { return hole.materials[t] >= 2; });
    CAPTURE(length, truth, floor.flux, floor.error);
    CHECK(floor.error < 0.0025 * truth);
    CHECK(std::abs(floor.flux - truth) < 0.005 * truth);
}

TEST_CASE(
    "sticking 0.001 in a deep trench: any roulette is unbiased, and every ledger balances to the last bit",
    "[slow]") {
    constexpr double kDepth = 10.0, kSticking = 0.001;
    const TrenchFlux truth = trench_flux(kDepth, kSticking, 200, 60);
    const auto mesh = extrude(trench_profile(kDepth, 0.05, {0.5}, {0.5}), 1.0);
    const double threshold = GENERATE(1.0, 0.9, 0.1);
    const auto result =
        trace(mesh, kPeriodic, {"test", 1.0, {kSticking}}, {.rays = 250'000, .roulette = threshold});
    check_ledger(result);
    CHECK((result.ledger.gained > 0) == (threshold > 0.1));
    const Mean wall = mean_flux(mesh, result, [&](std::size_t t) {
        const double z = triangle_centroid(mesh, t).z();
        return z < -1e-9 && z > -kDepth + 1e-9;
    });
    const Mean floor = mean_flux(
        mesh, result, [&](std::size_t t) { return triangle_centroid(mesh, t).z() < -kDepth + 1e-9; });
    CAPTURE(threshold, wall.flux, wall.error, truth.wall_mean, floor.flux, floor.error, truth.floor_mean);
    // One particle hits many times, so that triangles are correlated, which mean_flux leaves out.
    CHECK(std::abs(wall.flux - truth.wall_mean) < 0.01 * truth.wall_mean);
    CHECK(std::abs(floor.flux - truth.floor_mean) < 0.015 * truth.floor_mean);
}

TEST_CASE("sticking 0.001 in a deep hole: its floor gets what any roulette lets through, without bias",
          "[slow]") {
    constexpr double kLength = 20.0, kSticking = 0.001;
    const double truth = clausing_transmission(kLength, kSticking);
    const auto hole = round_hole(1.0, kLength, 1.02, 64, 0.5);
    Groups floor(1);
    for (std::size_t t = 0; t < hole.materials.size(); ++t)
        if (hole.materials[t] >= 2) floor[0].push_back(t);
    const double threshold = GENERATE(1.0, 0.9, 0.1);
    const Mean mean = over_seeds(hole.mesh, kReflective, {"test", 1.0, {1.0, kSticking, 1.0, 1.0}}, 2'000'000,
                                 0, floor, hole.materials, threshold)[0];
    CAPTURE(threshold, truth, mean.flux, mean.error);
    CHECK(mean.error < 0.0025 * truth);
    // The wall of a polygon of 64 sides is longer by 4e-4, see reference_test.cpp.
    CHECK(std::abs(mean.flux - truth) < 3.5 * mean.error + 5e-4 * truth);
}

TEST_CASE("weights that play roulette late agree with analog absorption", "[slow]") {
    constexpr double kDepth = 3.0;
    const double sticking = GENERATE(0.9, 0.3);
    const TrenchFlux truth = trench_flux(kDepth, sticking, 200, 60);
    const auto mesh = extrude(trench_profile(kDepth, 0.05, {0.5}, {0.5}), 1.0);
    for (const double threshold : {1.0, 0.5, 0.02}) {
        const auto result =
            trace(mesh, kPeriodic, {"test", 1.0, {sticking}}, {.rays = 1'000'000, .roulette = threshold});
        check_ledger(result);
        const Mean floor = mean_flux(
            mesh, result, [&](std::size_t t) { return triangle_centroid(mesh, t).z() < -kDepth + 1e-9; });
        CAPTURE(sticking, threshold, floor.flux, floor.error, truth.floor_mean);
        CHECK(std::abs(floor.flux - truth.floor_mean) < 3.0 * floor.error + 0.003 * truth.floor_mean);
    }
}

TEST_CASE(
    "over many seeds, the error in units of the standard error is Student's: mean 0, the right spread") {
    constexpr double kDepth = 2.0, kSticking = 0.5;
    const auto mesh = extrude(trench_profile(kDepth, 0.1, {0.5}, {}), 1.0);
    const TrenchFlux truth = trench_flux(kDepth, kSticking, 300, 100);
    const surface::RayScene scene(mesh);
    const auto box = lateral_box(mesh, kPeriodic);
    // One wedge fan covers the floor, so its flux and error are the tally's own: no covariance is left out.
    const auto wedges = make_wedges(mesh);
    std::vector<std::size_t> floor;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (triangle_centroid(mesh, t).z() < -kDepth + 1e-9) floor.push_back(t);
    REQUIRE(floor.size() == 2);
    constexpr int kSeeds = 400;
    double sum = 0.0, squares = 0.0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const auto result = trace_flux(mesh, scene, box, {"test", 1.0, {kSticking}}, {}, wedges,
                                       {.rays = 8192, .seed = static_cast<std::uint64_t>(seed)});
        // By symmetry both triangles have the floor's mean flux.
        const std::size_t t = floor[static_cast<std::size_t>(seed % 2)];
        const double z = (result.triangle.flux[t] - truth.floor_mean) / result.triangle.error[t];
        sum += z;
        squares += z * z;
    }
    const double mean = sum / kSeeds, variance = squares / kSeeds - mean * mean;
    CAPTURE(mean, variance);
    CHECK(std::abs(mean) < 4.0 / std::sqrt(kSeeds));
    // Student's t of 31 degrees of freedom has variance 31/29 and kurtosis 3.22.
    CHECK(std::abs(variance - 31.0 / 29.0) < 4.0 * 31.0 / 29.0 * std::sqrt(2.22 / kSeeds));
}
