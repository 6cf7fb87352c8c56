#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "flux/reflection.hpp"
#include "flux/yield.hpp"
#include "surface/basis.hpp"
#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/truth.hpp"

using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;

namespace {

// An almost parallel beam, of angular spread 1e-3.
Species parallel_beam(double tilt, double azimuth = 0.0) {
    Species beam{"beam", 1e6, {1.0}};
    beam.beam = Vec3(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth), -std::cos(tilt));
    return beam;
}

// A period of V-grooves of width 2 whose walls rise at `slope` from the horizontal.
TriangleMesh v_groove(double slope, std::size_t cuts = 1) {
    const double depth = std::tan(slope);
    Profile profile;
    for (std::size_t i = 0; i <= 2 * cuts; ++i) {
        const double x = static_cast<double>(i) / static_cast<double>(cuts);
        profile.emplace_back(x, -depth * (1.0 - std::abs(x - 1.0)));
    }
    return extrude(profile, 1.0);
}

Mean all_of(const TriangleMesh& mesh, const FluxResult& result) {
    return mean_flux(mesh, result, [](std::size_t) { return true; });
}

double mean_of(const TriangleMesh& mesh, const TallyFlux& tally) {
    double sum = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += triangle_area(mesh, t) * tally.triangle.flux[t];
    return sum / total_area(mesh);
}

double normal_density(double x, double mean, double sigma) {
    return std::exp(-0.5 * (x - mean) * (x - mean) / (sigma * sigma)) / (sigma * std::sqrt(2.0 * kPi));
}

// Mean of f over normal(mean, sigma) truncated to [low, high].
double truncated_mean(double mean, double sigma, double low, double high,
                      const std::function<double(double)>& f) {
    const auto weight = [&](double e) { return normal_density(e, mean, sigma); };
    return integral(
               low, high, [&](double e) { return weight(e) * f(e); }, 20000) /
           integral(low, high, weight, 20000);
}

}  // namespace

TEST_CASE(
    "a tilted beam casts a shadow whose edge lies at height times tangent, and lights planes by the cosine") {
    const double tilt = GENERATE(20.0, 50.0) * kDegree, height = 1.0, shadow = height * std::tan(tilt);
    // A block from x = 1 to 2, then the floor to x = 6 (= 0 of the next period), cut a little before and
    // after the edge of the shadow.
    const double penumbra = 0.02;
    const auto mesh = extrude({{0.0, 0.0},
                               {1.0, 0.0},
                               {1.0, height},
                               {2.0, height},
                               {2.0, 0.0},
                               {2.0 + shadow - penumbra, 0.0},
                               {2.0 + shadow + penumbra, 0.0},
                               {6.0, 0.0}},
                              1.0);
    const auto result = trace(mesh, kPeriodic, parallel_beam(tilt), {.rays = 500'000});
    check_balance(result);
    const auto segment = [&](std::size_t s) {
        return mean_flux(mesh, result, [&](std::size_t t) { return t / 2 == s; });
    };
    CHECK(segment(0).flux == Approx(1.0).epsilon(0.01));             // lit floor
    CHECK(segment(1).flux == Approx(std::tan(tilt)).epsilon(0.01));  // the wall that faces the beam
    CHECK(segment(2).flux == Approx(1.0).epsilon(0.01));             // the block's top
    CHECK(segment(3).flux == 0.0);                                   // the wall that faces away
    CHECK(segment(4).flux == 0.0);                                   // the shadow, to its edge
    CHECK(segment(5).flux == Approx(0.5).margin(0.05));              // half of what straddles the edge
    CHECK(segment(6).flux == Approx(1.0).epsilon(0.01));             // from the edge on
}

TEST_CASE("a beam's flux on a slope goes with the cosine of the incidence, whichever way it is tilted") {
    const double tilt = 25.0 * kDegree, slope = 30.0 * kDegree;
    const auto mesh = v_groove(slope);
    SECTION("across the groove") {
        const auto result = trace(mesh, kPeriodic, parallel_beam(tilt), {.rays = 400'000});
        check_balance(result);
        // Wall 0 slopes down to the right, the way the beam flies; wall 1 faces the beam.
        for (const auto& [segment, angle] : {std::pair(0u, slope + tilt), {1u, slope - tilt}}) {
            const Mean wall = mean_flux(mesh, result, [&](std::size_t t) { return t / 2 == segment; });
            CHECK(wall.flux == Approx(std::cos(angle) / std::cos(tilt)).epsilon(0.01));
        }
    }
    SECTION("along it") {
        const auto result = trace(mesh, kPeriodic, parallel_beam(tilt, kPi / 2.0), {.rays = 400'000});
        check_balance(result);
        CHECK(all_of(mesh, result).flux == Approx(std::cos(slope)).epsilon(0.002));
    }
}

TEST_CASE("a turning wafer lights vertical walls of every azimuth alike: tan(tilt) / pi") {
    const double tilt = 30.0 * kDegree;
    // A low block, so far from its images that it is not shadowed.
    const auto mesh = extrude({{0.0, 0.0}, {4.0, 0.0}, {4.0, 0.5}, {6.0, 0.5}, {6.0, 0.0}, {10.0, 0.0}}, 1.0);
    Species beam = parallel_beam(tilt);
    beam.rotating = true;
    const auto boundary = GENERATE(kPeriodic, kReflective);
    const auto result = trace(mesh, boundary, beam, {.rays = 1'000'000});
    check_balance(result);
    for (const std::size_t wall : {1u, 3u}) {
        const Mean mean = mean_flux(mesh, result, [&](std::size_t t) { return t / 2 == wall; });
        CHECK(std::abs(mean.flux - std::tan(tilt) / kPi) < 4.0 * mean.error + 1e-3);
        CHECK(mean.error < 0.02 * mean.flux);
    }
}

TEST_CASE("a tilted beam of any width brings flux 1 to an open plane") {
    Species beam{"beam", GENERATE(1.0, 20.0), {1.0}};
    beam.beam = Vec3(std::sin(1.0), 0.0, -std::cos(1.0));
    const auto mesh = height_field(3, 2, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const auto result = trace(mesh, kPeriodic, beam, {.rays = 100'000});
    check_balance(result);
    CHECK(result.arrivals == result.emitted);
    CHECK(all_of(mesh, result).flux == Approx(1.0).epsilon(1e-12));
}

TEST_CASE(
    "mirror walls at 45 degrees send a beam across and back up, and at 60 degrees it is met three times") {
    const double sticking = 0.3, go_on = 1.0 - sticking;
    Species beam = parallel_beam(0.0);
    beam.sticking = {sticking};
    beam.reflection.kind = Reemission::specular;
    SECTION("45 degrees") {
        const auto mesh = v_groove(45.0 * kDegree, 4);
        const auto result = trace(mesh, kPeriodic, beam, {.rays = 400'000});
        check_balance(result);
        for (std::size_t s = 0; s < 8; ++s) {
            const Mean strip = mean_flux(mesh, result, [&](std::size_t t) { return t / 2 == s; });
            CAPTURE(s, strip.flux, strip.error);
            CHECK(std::abs(strip.flux - std::sqrt(0.5) * (1.0 + go_on)) < 4.0 * strip.error + 3e-3);
        }
        CHECK(static_cast<double>(result.escaped) / static_cast<double>(result.emitted) ==
              Approx(go_on * go_on).margin(0.004));
    }
    SECTION("60 degrees") {
        // Unfolded about the apex, the ray at distance p from the axis meets walls at 2p, p and 2p from it.
        const auto mesh = v_groove(60.0 * kDegree, 4);
        const auto result = trace(mesh, kPeriodic, beam, {.rays = 400'000});
        check_balance(result);
        for (std::size_t s = 0; s < 8; ++s) {
            const Mean strip = mean_flux(mesh, result, [&](std::size_t t) { return t / 2 == s; });
            const bool low = s >= 2 && s < 6;  // nearer to the apex than half the wall's length, 2
            const double truth = 0.5 * (1.0 + go_on * go_on) + (low ? go_on : 0.0);
            CAPTURE(s, strip.flux, strip.error);
            CHECK(std::abs(strip.flux - truth) < 4.0 * strip.error + 0.01);
        }
    }
}

TEST_CASE("yield-weighted flux on a slope: cosine, angular factor and mean over the energies") {
    const double slope = GENERATE(0.0, 35.0, 65.0) * kDegree, cosine = std::cos(slope);
    const double mean = 100.0, sigma = 25.0;
    const auto mesh =
        slope == 0.0 ? height_field(2, 2, 1.0, 1.0, [](auto, auto) { return 0.0; }) : v_groove(slope);
    Species ions = parallel_beam(0.0);
    ions.energy = {mean, sigma};
    ions.yields = {{"flat", Angular::none, 20.0, {0.5}, {}},
                   {"cos", Angular::cosine, 4.0, {0.0361}, {}},
                   {"sp", Angular::sputter, 20.0, {0.0337}, {9.3}},
                   {"ie", Angular::enhanced, 15.0, {7.0}, {}},
                   {"poly", Angular::polynomial, 90.0, {1.0}, {1.0, 2.0, -0.5, 0.25}},
                   {"table", Angular::table, 0.0, {2.0}, {1.0, 0.5, 0.0}}};
    const auto result = trace(mesh, kPeriodic, ions, {.rays = 200'000});
    check_balance(result);
    REQUIRE(result.others.size() == 6);
    const double factor[] = {
        1.0,
        cosine,
        (1.0 + 9.3 * (1.0 - cosine * cosine)) * cosine,
        slope < 60.0 * kDegree ? 1.0 : 3.0 - 6.0 * slope / kPi,
        (cosine + 2.0 * std::pow(cosine, 2) - 0.5 * std::pow(cosine, 3) + 0.25 * std::pow(cosine, 4)) / 2.75,
        1.0 - slope / (kPi / 2.0)};
    for (std::size_t k = 0; k < 6; ++k) {
        const Yield& yield = ions.yields[k];
        const double energy = truncated_mean(mean, sigma, 0.0, 300.0, [&](double e) {
            return std::max(0.0, std::sqrt(e) - std::sqrt(yield.threshold));
        });
        CAPTURE(slope, yield.name);
        CHECK(mean_of(mesh, result.others[k]) ==
              Approx(cosine * yield.scale[0] * energy * factor[k]).epsilon(0.01));
    }
}

TEST_CASE("yields count by material") {
    const auto mesh = height_field(4, 4, 1.0, 1.0, [](auto, auto) { return 0.0; });
    std::vector<std::int32_t> materials;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        materials.push_back(triangle_centroid(mesh, t).x() < 0.5 ? 0 : 2);
    Species beam = parallel_beam(0.0);
    beam.yields = {{"y", Angular::none, 0.0, {3.0, 100.0, 0.25}, {}}};
    const auto result = trace(mesh, kPeriodic, beam, {.rays = 64'000}, materials);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        CHECK(result.others[0].triangle.flux[t] ==
              Approx((materials[t] == 0 ? 3.0 : 0.25) * result.triangle.flux[t]).epsilon(1e-6));
}

TEST_CASE("an ion keeps the energy that Belen's law says, and stops below its least") {
    // Every ion is reflected once, to the opposite wall: its second hit carries the reflected energy.
    Species ions = parallel_beam(0.0);
    ions.sticking = {0.0};
    ions.energy = {100.0, 0.0};
    ions.reflection.kind = Reemission::specular;
    ions.reflection.inflection = 0.6;
    ions.reflection.exponent = 4.0;
    ions.yields = {{"root", Angular::none, 0.0, {1.0}, {}}};
    const double theta = kPi / 4.0, cosine = std::cos(theta);
    const double a = 1.0 / (1.0 + 4.0 * (kPi / 2.0 / 0.6 - 1.0));
    const double peak = 1.0 - (1.0 - a) * (kPi / 2.0 - theta) / (kPi / 2.0 - 0.6);
    CHECK(energy_peak(ions.reflection, theta) == Approx(peak));
    const auto mesh = v_groove(theta);
    SECTION("energies") {
        const auto result = trace(mesh, kPeriodic, ions, {.rays = 400'000});
        check_balance(result);
        CHECK(result.escaped == result.emitted);
        const double second =
            truncated_mean(100.0 * peak, 10.0, 0.0, 100.0, [](double e) { return std::sqrt(e); });
        CHECK(mean_of(mesh, result.others[0]) == Approx(cosine * (10.0 + second)).epsilon(0.002));
    }
    SECTION("the least") {
        ions.stop_energy = 100.0 * peak;
        const auto result = trace(mesh, kPeriodic, ions, {.rays = 400'000});
        check_balance(result);
        const double above =
            integral(100.0 * peak, 100.0, [&](double e) { return normal_density(e, 100.0 * peak, 10.0); }) /
            integral(0.0, 100.0, [&](double e) { return normal_density(e, 100.0 * peak, 10.0); });
        CHECK(all_of(mesh, result).flux == Approx(cosine * (1.0 + above)).epsilon(0.005));
    }
}

TEST_CASE("below the inflection the energy left is a power of the incidence, and both laws meet there") {
    const Reflection r;
    const double a = 1.0 / (1.0 + 10.0 * (kPi / 2.0 / 1.55334303 - 1.0));
    CHECK(energy_peak(r, 1.55334303) == Approx(a));
    CHECK(energy_peak(r, 1.55334303 - 1e-12) == Approx(a));
    CHECK(energy_peak(r, kPi / 2.0) == Approx(1.0));
    CHECK(energy_peak(r, 0.8) == Approx(a * std::pow(0.8 / 1.55334303, 10.0)));
    CHECK(energy_peak(r, 0.0) == 0.0);
}

TEST_CASE("ions are reflected with a probability that rises linearly with the incidence") {
    const Species ions = ion("ion");
    CHECK(reflection_probability(ions.reflection, 69.9 * kDegree) == 0.0);
    CHECK(reflection_probability(ions.reflection, 75.0 * kDegree) == Approx(0.25));
    CHECK(reflection_probability(ions.reflection, 90.0 * kDegree) == Approx(1.0));
    CHECK(reflection_probability(Reflection{}, 0.0) == 1.0);
    // In a trace: walls at 75 degrees reflect 0.25 of the ions.
    Species beam = parallel_beam(0.0);
    beam.sticking = {0.0};
    beam.reflection = ions.reflection;
    beam.energy = {100.0, 10.0};
    const auto mesh = v_groove(75.0 * kDegree);
    const auto result = trace(mesh, kPeriodic, beam, {.rays = 200'000});
    check_balance(result);
    // The first hit absorbs 0.75. Reflected ions meet the other wall steeply, where nearly all stay.
    CHECK(result.arrivals > result.emitted);
    CHECK(static_cast<double>(result.arrivals) / static_cast<double>(result.emitted) ==
          Approx(1.25).margin(0.03));
}

namespace {

// Chi-square test, over 20 bins, of angles against the density of a coned cosine of half-angle \p alpha.
void check_cone(double alpha, std::uint32_t samples, const std::function<double(std::uint32_t)>& angle) {
    constexpr int kBins = 20;
    const auto density = [&](double psi) { return std::cos(0.5 * kPi * psi / alpha) * std::sin(psi); };
    const double total = integral(0.0, alpha, density);
    std::array<double, kBins> counts{};
    for (std::uint32_t i = 0; i < samples; ++i)
        ++counts[static_cast<std::size_t>(std::min(kBins - 1.0, angle(i) / alpha * kBins))];
    double chi = 0.0;
    for (int b = 0; b < kBins; ++b) {
        const double expected =
            samples * integral(alpha * b / kBins, alpha * (b + 1) / kBins, density) / total;
        chi += std::pow(counts[static_cast<std::size_t>(b)] - expected, 2) / expected;
    }
    CAPTURE(alpha, chi);
    CHECK(chi < kBins - 1 + 4.0 * std::sqrt(2.0 * (kBins - 1)));
}

}  // namespace

TEST_CASE("the coned cosine fills its cone with the right density and keeps above the surface") {
    const double alpha = 50.0 * kDegree;
    check_cone(alpha, 200'000, [&](std::uint32_t i) {
        Stream random(random_key(3, 0, 0), {.ray = i, .bounce = 1});
        const double psi = sample_cone_angle(alpha, random);
        REQUIRE((psi >= 0.0 && psi <= alpha));
        return psi;
    });

    const Vec3 normal = Vec3(0.3, -0.2, 0.9).normalized();
    for (const double theta : {0.0, 30.0, 79.0, 85.0, 89.99}) {
        const Vec3 tangent = basis_around(normal).first;
        const Vec3 in = std::sin(theta * kDegree) * tangent - std::cos(theta * kDegree) * normal;
        const Vec3 mirror = mirrored(in, normal);
        const double cone = kPi / 2.0 - std::min(theta * kDegree, Reflection{}.cone);
        for (std::uint32_t i = 0; i < 1000; ++i) {
            Stream random(random_key(4, 0, 0), {.ray = i, .bounce = 1});
            const Vec3 out = sample_coned(Reflection{}, in, normal, theta * kDegree, random);
            REQUIRE(std::abs(out.norm() - 1.0) < 1e-9);
            REQUIRE(out.dot(normal) >= 0.0);
            REQUIRE(std::acos(std::clamp(out.dot(mirror), -1.0, 1.0)) <= cone + 1e-6);
        }
    }
}

TEST_CASE("a cone that the surface cuts keeps its density of angles to the mirrored direction") {
    for (const double theta : {85.0, 89.9}) {  // the cone is 10 degrees wide
        CAPTURE(theta);
        const Vec3 in(std::sin(theta * kDegree), 0.0, -std::cos(theta * kDegree));
        check_cone(kPi / 2.0 - Reflection{}.cone, 100'000, [&](std::uint32_t i) {
            Stream random(random_key(5, 0, 0), {.ray = i, .bounce = 1});
            const Vec3 out = sample_coned(Reflection{}, in, Vec3::UnitZ(), theta * kDegree, random);
            return std::acos(std::clamp(out.dot(mirrored(in, Vec3::UnitZ())), -1.0, 1.0));
        });
    }
}

TEST_CASE("what a hit sputters along the mirrored direction crosses the groove, with its own ledger") {
    const double slope = 45.0 * kDegree, cosine = std::cos(slope);
    Species beam = parallel_beam(0.0);
    beam.redeposition = Redeposition{{"out", Angular::cosine, 0.0, {0.8}, {}}, Reemission::specular, {1.0}};
    const auto mesh = v_groove(slope);
    const auto result = trace(mesh, kPeriodic, beam, {.rays = 100'000});
    check_balance(result);
    REQUIRE(result.others.size() == 1);
    CHECK(mean_of(mesh, result.others[0]) == Approx(0.8 * cosine * cosine).epsilon(0.002));
    CHECK(static_cast<double>(result.redeposited.emitted) ==
          Approx(0.8 * cosine * static_cast<double>(result.ledger.emitted)).epsilon(1e-4));
    // Only the beam's spread of 1e-3 lifts some over the rim.
    CHECK(static_cast<double>(result.redeposited.escaped) <
          2e-3 * static_cast<double>(result.redeposited.emitted));
}

TEST_CASE("what a hit sputters starts within the cone of the ion's incidence") {
    // On walls 60 degrees steep a cone is 30 degrees wide about a direction 30 degrees below the horizontal:
    // nothing goes up.
    Species beam = parallel_beam(0.0);
    beam.redeposition = Redeposition{{"out", Angular::none, 0.0, {0.8}, {}}, Reemission::coned, {1.0}};
    const auto result = trace(v_groove(60.0 * kDegree), kPeriodic, beam, {.rays = 100'000});
    check_balance(result);
    CHECK(static_cast<double>(result.redeposited.escaped) <
          2e-3 * static_cast<double>(result.redeposited.emitted));
}

TEST_CASE("what a trench's floor sputters diffusely arrives as exact view factors and radiosity say") {
    constexpr double kDepth = 1.5, kYield = 0.7;
    const double sticking = GENERATE(1.0, 0.4);
    const TrenchFlux exact = trench_flux(kDepth, sticking, 200, 100, Emitter::floor);
    // View factor of a wall element at height h over a floor of width 1: (1 - h / sqrt(h^2 + 1)) / 2.
    if (sticking == 1.0)
        CHECK(exact.wall_mean ==
              Approx(0.5 * (kDepth - std::sqrt(kDepth * kDepth + 1.0) + 1.0) / kDepth).epsilon(1e-6));
    Species beam = parallel_beam(0.0);
    beam.redeposition =
        Redeposition{{"out", Angular::none, 0.0, {kYield}, {}}, Reemission::diffuse, {sticking}};
    const auto mesh = extrude(trench_profile(kDepth, 0.2, {0.5}, {0.5}), 1.0);
    double wall[2]{}, floor[2]{};  // sums over seeds, of values and of squares
    constexpr int kSeeds = 32;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const auto result = trace(mesh, kPeriodic, beam, {.rays = 50'000, .seed = seed});
        check_balance(result);
        REQUIRE(result.others.size() == 1);
        double of_wall = 0.0, of_floor = 0.0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const double z = triangle_centroid(mesh, t).z();
            const double caught = triangle_area(mesh, t) * result.others[0].triangle.flux[t];
            if (z < -1e-9) (z < -kDepth + 1e-9 ? of_floor : of_wall) += caught;
        }
        of_wall /= 2.0 * kDepth;
        for (const auto& [sums, value] : {std::pair(wall, of_wall), {floor, of_floor}}) {
            sums[0] += value / kSeeds;
            sums[1] += value * value / kSeeds;
        }
    }
    // The beam's spread takes 1e-3 of it from the floor to the foot of the walls, which send half of what
    // they sputter back down.
    constexpr double kSpread = 2e-3;
    for (const auto& [sums, truth] :
         {std::pair(wall, kYield * exact.wall_mean), {floor, kYield * exact.floor_mean}}) {
        const double error = std::sqrt((sums[1] - sums[0] * sums[0]) / (kSeeds - 1));
        CAPTURE(sticking, sums[0], error, truth);
        CHECK(error < 0.0025 * kYield * exact.wall_mean);
        CHECK(std::abs(sums[0] - truth) < 3.5 * error + kSpread * kYield * exact.wall_mean);
    }
}

TEST_CASE(
    "the error of what is sputtered is that of the scatter between seeds, and a trace to an error reaches it") {
    Species beam = parallel_beam(0.0);
    beam.redeposition = Redeposition{{"out", Angular::none, 0.0, {0.7}, {}}, Reemission::diffuse, {0.5}};
    const auto mesh = extrude(trench_profile(1.5, 0.2, {0.5}, {0.5}), 1.0, 3);
    const Wedges wedges = make_wedges(mesh);
    std::vector<double> sum(mesh.vertices.size()), squares(sum.size());
    double told = 0.0;
    constexpr int kSeeds = 64;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const FluxResult result = trace(mesh, kPeriodic, beam, {.rays = 4000, .seed = seed});
        told += result.redeposition_error / kSeeds;
        for (std::size_t v = 0; v < sum.size(); ++v) {
            const double flux = result.others[0].vertex.flux[v];
            sum[v] += flux / kSeeds, squares[v] += flux * flux / kSeeds;
        }
    }
    double scatter = 0.0;
    for (std::size_t v = 0; v < sum.size(); ++v)
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w)
            scatter += wedges.area[w] * std::sqrt(std::max(0.0, squares[v] - sum[v] * sum[v]));
    const auto box = lateral_box(mesh, kPeriodic);
    CHECK(told == Approx(scatter / (0.7 * box.area())).epsilon(0.1));

    const auto to = [&](double error) {
        return trace(mesh, kPeriodic, beam, {.rays = 10'000'000, .relative_error = error});
    };
    const FluxResult half = to(0.5 * told), tenth = to(0.1 * told);
    CHECK(half.redeposition_error <= 0.5 * told);
    CHECK(tenth.redeposition_error <= 0.1 * told);
    CHECK(tenth.relative_error < 0.1 * told);  // the arrivals reached it earlier
    CHECK(tenth.emitted > 200'000);
    CHECK(tenth.emitted < 800'000);
    CHECK(trace(mesh, kPeriodic, parallel_beam(0.0), {.rays = 4000}).redeposition_error == 0.0);
}

TEST_CASE("ions have the same bits for any task size") {
    Species ions = ion("ion");
    ions.yields = {{"sp", Angular::sputter, 20.0, {0.0337}, {9.3}}};
    ions.redeposition = Redeposition{{"out", Angular::cosine, 20.0, {0.1}, {}}, Reemission::coned, {0.5}};
    const auto mesh = v_groove(70.0 * kDegree, 3);
    const auto one = trace(mesh, kPeriodic, ions, {.rays = 100'000});
    const auto other = trace(mesh, kPeriodic, ions, {.rays = 100'000, .task_rays = 100'000});
    check_balance(one);
    CHECK(one.ledger == other.ledger);
    CHECK(one.redeposited == other.redeposited);
    for (std::size_t k = 0; k < 3; ++k) CHECK(one.tally(k).wedge.flux == other.tally(k).wedge.flux);
    CHECK(tally_names(ions) == std::vector<std::string>{"ion", "ion_sp", "ion_redeposited"});
}

TEST_CASE("sticking by coverage: a probability by wedge takes the place of the material's") {
    const auto mesh = extrude(trench_profile(2.0, 0.1, {0.5}, {0.5}), 1.0, 2);
    const surface::RayScene scene(mesh);
    const auto box = lateral_box(mesh, kPeriodic);
    const auto wedges = make_wedges(mesh);
    const std::vector<double> uniform(wedges.count(), 0.25);
    const auto by_material = trace_flux(mesh, scene, box, {"n", 1.0, {0.25}}, {}, wedges, {.rays = 100'000});
    const auto by_wedge = trace_flux(mesh, scene, box, {"n", 1.0, {1.0}}, {}, wedges,
                                     {.rays = 100'000, .sticking_by_wedge = uniform});
    CHECK(by_wedge.triangle.flux == by_material.triangle.flux);
    // A floor that absorbs all below walls that absorb nothing is Clausing's case in two dimensions.
    std::vector<double> floor(wedges.count(), 0.0);
    std::vector<std::int32_t> materials(mesh.triangles.size(), 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (triangle_centroid(mesh, t).z() < -2.0 + 1e-9) {
            materials[t] = 1;
            for (std::size_t k = 0; k < 3; ++k) floor[wedges.corner[3 * t + k]] = 1.0;
        }
    const auto two =
        trace_flux(mesh, scene, box, {"n", 1.0, {0.0, 1.0}}, materials, wedges, {.rays = 100'000});
    const auto same = trace_flux(mesh, scene, box, {"n", 1.0, {1.0}}, {}, wedges,
                                 {.rays = 100'000, .sticking_by_wedge = floor});
    CHECK(same.triangle.flux == two.triangle.flux);
}

TEST_CASE("beams and yields out of range are refused by name and value") {
    const auto mesh = v_groove(0.5);
    const auto refused = [&](const Species& species, std::array<Boundary, 2> boundary,
                             const std::string& text) {
        CAPTURE(text);
        CHECK_THROWS_AS(trace(mesh, boundary, species, {.rays = 1000}), RecipeError);
        CHECK_THROWS_WITH(trace(mesh, boundary, species, {.rays = 1000}), Contains(text));
    };
    refused(parallel_beam(0.3), kReflective, "use periodic sides");
    CHECK_NOTHROW(
        trace(mesh, {Boundary::periodic, Boundary::reflective}, parallel_beam(0.3), {.rays = 1000}));
    Species s = ion("Ar");
    s.beam = Vec3(0.0, 0.0, 1.0);
    refused(s, kPeriodic, "point downwards");
    s = ion("Ar", {-5.0, 1.0});
    refused(s, kPeriodic, "Ar: energy = -5");
    s = ion("Ar", {100.0, 200.0});
    refused(s, kPeriodic, "Ar: energy spread = 200");
    s = ion("Ar");
    s.yields = {{"sp", Angular::sputter, 20.0, {1.0}, {}}};
    refused(s, kPeriodic, "Ar sp: needs 1 coefficients");
    s.yields = {{"sp", Angular::none, 0.0, {1e6}, {}}};
    refused(s, kPeriodic, "largest yield");
    s.yields = {{"sp", Angular::none, -1.0, {1.0}, {}}};
    refused(s, kPeriodic, "threshold = -1");
    s = ion("Ar");
    s.reflection.to = 0.1;
    refused(s, kPeriodic, "reflection to = 0.1");
}
