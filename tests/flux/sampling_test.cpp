#include "flux/sampling.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <set>

#include "flux/random.hpp"
#include "surface/basis.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

/// Density of sample_cosine_power, per steradian, at an angle whose cosine to the axis is \p cosine.
double cosine_power_density(double cosine, double exponent) {
    return cosine > 0.0 ? (exponent + 1.0) / (2.0 * std::numbers::pi) * std::pow(cosine, exponent) : 0.0;
}

/// Density of sample_lambertian, per steradian.
double lambertian_density(double cosine) {
    return std::max(0.0, cosine) * std::numbers::inv_pi;
}

/// A point of the unit square for sample \p i of \p count, uniform over the i-th of \p count equal pieces of
/// a Hilbert curve. All samples together thus cover the square evenly, and consecutive ones lie close to each
/// other, which keeps the ray tracer's cache warm. \p u uniform in (0, 1), \p jitter 32 random bits.
std::pair<double, double> sample_square(std::uint64_t i, std::uint64_t count, double u,
                                        std::uint32_t jitter) {
    const double along = (static_cast<double>(i) + u) / static_cast<double>(count) * 0x1p32;
    const auto [x, y] = hilbert_cell(static_cast<std::uint32_t>(std::min(along, 0x1p32 - 1.0)));
    return {(x + ((jitter >> 16) + 0.5) * 0x1p-16) * 0x1p-16,
            (y + ((jitter & 0xffffu) + 0.5) * 0x1p-16) * 0x1p-16};
}

// Chi-square of directions against a density, over polar x azimuthal bins of the hemisphere about the axis.
// Polar bins share the range [0, max_angle]; what lies beyond is one more bin.
struct ChiSquare {
    double value = 0.0, degrees = 0.0;
};

ChiSquare compare_to_density(const Vec3& axis, double max_angle,
                             const std::function<Vec3(const Draws&)>& sample,
                             const std::function<double(double)>& density) {
    constexpr int kPolar = 12, kAzimuthal = 8, kSamples = 400'000;
    std::array<double, kPolar * kAzimuthal + 1> counts{}, expected{};
    const auto [s, t] = basis_around(axis);
    const RandomKey key = random_key(7, 0, 0);
    double longest = 0.0;
    for (std::uint64_t i = 0; i < kSamples; ++i) {
        const Vec3 d = sample(draw(key, i, 0));
        longest = std::max(longest, std::abs(d.norm() - 1.0));
        const double angle = std::atan2(axis.cross(d).norm(), axis.dot(d));
        const double azimuth = std::atan2(d.dot(t), d.dot(s)) / (2.0 * std::numbers::pi) + 0.5;
        const int polar = static_cast<int>(angle / max_angle * kPolar);
        const int around = std::min(kAzimuthal - 1, static_cast<int>(azimuth * kAzimuthal));
        ++counts[static_cast<std::size_t>(polar < kPolar ? polar * kAzimuthal + around
                                                         : kPolar * kAzimuthal)];
    }
    CHECK(longest < 1e-12);
    expected.back() = kSamples;
    for (int p = 0; p < kPolar; ++p) {
        // Midpoint rule over the bin's polar angle: density * sin(angle).
        double share = 0.0;
        constexpr int kSteps = 2000;
        const double width = max_angle / kPolar / kSteps;
        for (int k = 0; k < kSteps; ++k) {
            const double angle = (p * kSteps + k + 0.5) * width;
            share += density(std::cos(angle)) * std::sin(angle) * width * 2.0 * std::numbers::pi / kAzimuthal;
        }
        for (int a = 0; a < kAzimuthal; ++a) {
            expected[static_cast<std::size_t>(p * kAzimuthal + a)] = share * kSamples;
            expected.back() -= share * kSamples;
        }
    }
    ChiSquare chi;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (expected[i] < 5.0) continue;
        chi.value += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
        chi.degrees += 1.0;
    }
    chi.degrees -= 1.0;
    return chi;
}

}  // namespace

TEST_CASE("sampled directions follow their density about any axis", "[slow]") {
    const Vec3 axis =
        GENERATE(Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(0.3, -0.5, -0.2), Vec3(1e-9, 0, -1))
            .normalized();
    SECTION("Lambert") {
        const auto chi = compare_to_density(
            axis, std::numbers::pi / 2,
            [&](const Draws& d) { return sample_lambertian(axis, d.uniform(0), d.uniform(1)); },
            lambertian_density);
        CAPTURE(chi.degrees);
        CHECK(chi.value < chi.degrees + 4.0 * std::sqrt(2.0 * chi.degrees));
    }
    SECTION("cosine power") {
        const double n = GENERATE(0.0, 1.0, 10.0, 1000.0, 5000.0);
        const double max_angle = std::min(std::numbers::pi / 2, 3.5 / std::sqrt(n + 1.0));
        const auto chi = compare_to_density(
            axis, max_angle,
            [&](const Draws& d) { return sample_cosine_power(axis, n, d.uniform(0), d.uniform(1)); },
            [&](double cosine) { return cosine_power_density(cosine, n); });
        CAPTURE(n, chi.degrees);
        CHECK(chi.value < chi.degrees + 4.0 * std::sqrt(2.0 * chi.degrees));
    }
    SECTION("a sputtered target's, under- and over-cosine") {
        const double b = GENERATE(-1.0, -0.5, 0.0, 3.0);
        const auto chi = compare_to_density(
            axis, std::numbers::pi / 2,
            [&](const Draws& d) { return sample_cosine_beta(axis, b, d.uniform(0), d.uniform(1)); },
            [&](double c) { return c * (1.0 + b * c * c) / (std::numbers::pi * (1.0 + 0.5 * b)); });
        CAPTURE(b, chi.degrees);
        CHECK(chi.value < chi.degrees + 4.0 * std::sqrt(2.0 * chi.degrees));
    }
}

TEST_CASE("exponent 1 is Lambert's law") {
    for (const double cosine : {0.01, 0.3, 0.9})
        CHECK(cosine_power_density(cosine, 1.0) == Approx(lambertian_density(cosine)));
    CHECK(lambertian_density(-0.5) == 0.0);
    CHECK(cosine_power_density(-0.5, 3.0) == 0.0);
}

TEST_CASE("the two vectors around a direction complete a right-handed basis") {
    for (std::uint64_t i = 0; i < 1000; ++i) {
        const Draws d = draw(random_key(1, 0, 0), i, 0);
        Vec3 n = sample_lambertian(Vec3::UnitX(), d.uniform(0), d.uniform(1));
        if (i % 2) n = -n;
        const auto [s, t] = basis_around(n);
        CHECK((s.cross(t) - n).norm() < 1e-12);
        CHECK(std::abs(s.norm() - 1.0) < 1e-12);
        CHECK(std::abs(s.dot(n)) < 1e-12);
    }
}

TEST_CASE("random words depend on every part of their name, and on nothing else") {
    std::set<std::array<std::uint32_t, 4>> seen;
    int names = 0;
    for (const std::uint64_t seed : {0ull, 1ull, 1ull << 32})
        for (const std::uint32_t time_step : {0u, 1u})
            for (const std::uint32_t species : {0u, 1u})
                for (const std::uint64_t ray : {0ull, 1ull, 1ull << 32})
                    for (const std::uint32_t bounce : {0u, 1u}) {
                        const Draws d = draw(random_key(seed, time_step, species), ray, bounce);
                        CHECK(d.word == draw(random_key(seed, time_step, species), ray, bounce).word);
                        seen.insert(d.word);
                        ++names;
                    }
    CHECK(seen.size() == static_cast<std::size_t>(names));
    // The extremes stay inside the open interval: log(u) and sqrt(1 - u) are safe.
    const Draws extremes{{0u, 0xffffffffu, 0u, 0u}};
    CHECK(extremes.uniform(0) > 0.0);
    CHECK(extremes.uniform(1) < 1.0);
}

TEST_CASE("consecutive cells of the Hilbert curve touch") {
    for (std::uint32_t i = 0; i < 100'000; ++i) {
        const auto [x0, y0] = hilbert_cell(i * 40'000u);
        const auto [x1, y1] = hilbert_cell(i * 40'000u + 1u);
        const auto apart = std::abs(static_cast<int>(x1) - static_cast<int>(x0)) +
                           std::abs(static_cast<int>(y1) - static_cast<int>(y0));
        REQUIRE(apart == 1);
    }
}

TEST_CASE("stratified points cover the square evenly: 4^k samples put one into each of 4^k cells") {
    constexpr std::uint64_t kSide = 32;
    std::set<std::pair<int, int>> cells;
    for (std::uint64_t i = 0; i < kSide * kSide; ++i) {
        const Draws d = draw(random_key(3, 0, 0), i, 0);
        const auto [x, y] = sample_square(i, kSide * kSide, d.uniform(0), d.word[1]);
        REQUIRE((x > 0.0 && x < 1.0 && y > 0.0 && y < 1.0));
        cells.emplace(static_cast<int>(x * kSide), static_cast<int>(y * kSide));
    }
    CHECK(cells.size() == kSide * kSide);
}

TEST_CASE("each stratified point is uniform over the square when all strata are drawn") {
    // 1000 repetitions of 7 strata, which do not end at borders of cells: chi-square over 8 x 8 cells.
    std::array<double, 64> counts{};
    for (std::uint64_t i = 0; i < 7000; ++i) {
        const Draws d = draw(random_key(5, 0, 0), i, 0);
        const auto [x, y] = sample_square(i % 7, 7, d.uniform(0), d.word[1]);
        ++counts[static_cast<std::size_t>(x * 8) * 8 + static_cast<std::size_t>(y * 8)];
    }
    double chi = 0.0;
    for (const double c : counts) chi += (c - 7000.0 / 64) * (c - 7000.0 / 64) / (7000.0 / 64);
    CHECK(chi < 63.0 + 4.0 * std::sqrt(2.0 * 63.0));
}

TEST_CASE("a tabulated source sends every bin its share, even over its angles, azimuths and energies") {
    const std::vector<SourceBin> bins = {{0.0, 0.1, 50.0, 100.0, 0.5},
                                         {0.1, 0.4, 50.0, 100.0, 0.625},
                                         {0.2, 0.2, 10.0, 10.0, 0.75},
                                         {0.0, 0.3, 0.0, 20.0, 1.0}};
    const Vec3 axis = Vec3(0.3, -0.2, -1.0).normalized();
    const auto [s, t] = basis_around(axis);
    constexpr int kDraws = 90'000, kParts = 3;
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(1e-12, 1.0 - 1e-12);
    std::vector<int> counts(bins.size() * kParts * kParts * kParts, 0);
    int sharp = 0;
    for (int n = 0; n < kDraws; ++n) {
        const double u1 = uniform(random), u2 = uniform(random), u3 = uniform(random);
        const auto [d, energy] = sample_bins(bins, axis, u1, u2, u3);
        REQUIRE(d.norm() == Approx(1.0).epsilon(1e-12));
        std::size_t k = 0;
        while (u1 > bins[k].until) ++k;
        const SourceBin& bin = bins[k];
        const double angle = std::acos(std::clamp(d.dot(axis), -1.0, 1.0));
        REQUIRE(angle >= bin.angle_from - 1e-7);
        REQUIRE(angle <= bin.angle_to + 1e-7);
        REQUIRE(energy >= bin.energy_from);
        REQUIRE(energy <= bin.energy_to);
        if (k == 2) {  // one angle and one energy
            ++sharp;
            continue;
        }
        const auto part = [](double x, double from, double to) {
            return std::clamp(static_cast<int>(kParts * (x - from) / (to - from)), 0, kParts - 1);
        };
        const double azimuth = std::atan2(d.dot(t), d.dot(s)) + std::numbers::pi;
        const int i = part(angle, bin.angle_from, bin.angle_to),
                  j = part(energy, bin.energy_from, bin.energy_to),
                  a = part(azimuth, 0.0, 2.0 * std::numbers::pi);
        ++counts[((k * kParts + static_cast<std::size_t>(i)) * kParts + static_cast<std::size_t>(j)) *
                     kParts +
                 static_cast<std::size_t>(a)];
    }
    double chi = std::pow(sharp - kDraws / 8.0, 2) / (kDraws / 8.0), before = 0.0;
    for (std::size_t k = 0; k < bins.size(); ++k) {
        const double expected = kDraws * (bins[k].until - before) / 27.0;
        before = bins[k].until;
        for (std::size_t c = 0; c < 27 && k != 2; ++c)
            chi += std::pow(counts[27 * k + c] - expected, 2) / expected;
    }
    // 82 cells, 81 degrees of freedom: 99.9 % of such sums lie below 126.1 and above 46.5.
    CHECK(chi < 126.1);
    CHECK(chi > 46.5);
}
