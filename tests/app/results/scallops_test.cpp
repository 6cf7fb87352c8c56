#include "app/results/metrology.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

using namespace sidewall;
using namespace sidewall::app;

// Walls with arcs between sharp edges, of known pitch and depth.
namespace {

constexpr double kSpacing = 0.05, kStep = kSpacing / 4.0, kDepth = 4.0, kArc = 0.06;

// Openings at depths kStep apart, from half the opening as a function of depth.
template <class Half>
std::vector<double> openings_of(Half&& half) {
    std::vector<double> openings;
    for (int k = 0; (k + 0.5) * kStep < kDepth; ++k) openings.push_back(2.0 * half((k + 0.5) * kStep));
    return openings;
}

double arcs(double depth, double pitch) {
    return kArc * std::abs(std::sin(std::numbers::pi * depth / pitch));
}

// A pseudo-random number from -1 to 1.
double scattered(int k) {
    std::uint32_t n = static_cast<std::uint32_t>(k) * 2654435761u;
    n = (n ^ (n >> 15)) * 2246822519u;
    return static_cast<double>(n ^ (n >> 13)) / 2147483648.0 - 1.0;
}

// Error of the pitch: edges are found at samples, and the first and the last may be off by half a step.
double pitch_margin(double pitch) {
    return 1.001 * kStep / (std::floor(kDepth / pitch) - 2.0);
}

// Error of the depth: samples miss the edge, where the arc is steepest, and the deepest point by half a step.
double depth_margin(double pitch) {
    const double half = 0.5 * kStep * std::numbers::pi / pitch;
    return 1.001 * kArc * (std::sin(half) + 1.0 - std::cos(half));
}

}  // namespace

TEST_CASE("scallops have the pitch and the depth that a wall was made with") {
    for (const double pitch : {0.2, 0.394, 0.8}) {
        const Scallops found =
            scallops(openings_of([&](double z) { return 1.0 + arcs(z, pitch); }), kStep, kSpacing);
        INFO(pitch);
        CHECK(found.pitch == Approx(pitch).margin(pitch_margin(pitch)));
        CHECK(found.depth == Approx(kArc).margin(depth_margin(pitch)));
    }
}

TEST_CASE("a wall's slope, its bow and a narrow mouth are no part of its scallops") {
    constexpr double kPitch = 0.4;
    for (const double slope : {-0.087, 0.05, 0.087}) {  // up to 5 degrees
        const Scallops found = scallops(
            openings_of([&](double z) { return 1.0 + slope * z + arcs(z, kPitch); }), kStep, kSpacing);
        INFO(slope);
        CHECK(found.pitch == Approx(kPitch).margin(pitch_margin(kPitch)));
        CHECK(found.depth == Approx(kArc).margin(depth_margin(kPitch)));
    }
    const Scallops bowed =
        scallops(openings_of([](double z) {
                     return 1.0 + 0.1 * std::sin(std::numbers::pi * z / kDepth) + arcs(z, kPitch);
                 }),
                 kStep, kSpacing);
    CHECK(bowed.pitch == Approx(kPitch).margin(pitch_margin(kPitch)));
    // The bow adds its own sagitta over one pitch: 0.1 (pi / 4)^2 0.4^2 / 8 at most.
    CHECK(bowed.depth == Approx(kArc).margin(depth_margin(kPitch) + 0.0013));
}

TEST_CASE("noise on a wall makes no scallops of its own") {
    constexpr double kPitch = 0.394, kNoise = 0.008;
    int n = 0;
    const Scallops found = scallops(
        openings_of([&](double z) { return 1.0 + 0.03 * z + arcs(z, kPitch) + kNoise * scattered(++n); }),
        kStep, kSpacing);
    // Noise moves an edge at most by the distance in which the arc rises by twice the noise.
    const double moved = 2.0 * kNoise / (kArc * std::numbers::pi / kPitch);
    CHECK(found.pitch == Approx(kPitch).margin(pitch_margin(kPitch) * (1.0 + 2.0 * moved / kStep)));
    CHECK(found.depth == Approx(kArc).margin(depth_margin(kPitch) + 2.0 * kNoise));
}

TEST_CASE("rests of film beside edges, and edges that are missing, change no pitch") {
    constexpr double kPitch = 0.394;
    // Beside the second, fifth and last edge a residue stands out as far as an edge; the seventh is missing.
    const auto wall = [](double z) {
        const double edge = std::round(z / kPitch), from = z - edge * kPitch;
        if (edge == 7.0) return 1.0 + kArc;
        if ((edge == 2.0 || edge == 5.0 || edge == 10.0) && std::abs(from - 0.1) < 0.02)
            return 1.0 + 0.2 * kArc;
        return 1.0 + arcs(z, kPitch);
    };
    const Scallops found = scallops(openings_of(wall), kStep, kSpacing);
    CHECK(found.pitch == Approx(kPitch).margin(pitch_margin(kPitch)));
    CHECK(found.depth == Approx(kArc).margin(depth_margin(kPitch)));
}

TEST_CASE("a smooth wall has no scallops, nor has one with a single edge") {
    CHECK(std::isnan(scallops(openings_of([](double) { return 1.0; }), kStep, kSpacing).pitch));
    CHECK(std::isnan(
        scallops(openings_of([](double z) { return 1.0 + arcs(z, 2.1); }), kStep, kSpacing).pitch));
    CHECK(std::isnan(scallops({}, kStep, kSpacing).depth));
}

TEST_CASE("a note tells that cycles times the pitch are not the depth") {
    Recipe recipe;
    recipe.steps.resize(1);
    recipe.steps[0].repeat = 10;
    recipe.steps[0].steps.resize(2);
    CHECK(scallop_note(recipe, Json{{"scallop_pitch", 0.39}, {"depth", 3.7}}).empty());
    CHECK(scallop_note(recipe, Json{{"scallop_pitch", 0.226}, {"depth", 3.94}})
              .find("10 cycles of 0.226 um are 2.26 um") != std::string::npos);
    CHECK(scallop_note(recipe, Json{{"scallop_pitch", nullptr}, {"depth", 3.94}}).empty());
    // With 10 cycles down to 3.9 each is 0.39 high: 7.8 cells of 0.05, whether or not scallops are seen.
    recipe.domain.grid_spacing = 0.05;
    for (const Json& pitch : {Json(0.39), Json(nullptr)})
        CHECK(scallop_note(recipe, Json{{"scallop_pitch", pitch}, {"depth", 3.9}}).find("have 7.8 cells") !=
              std::string::npos);
    recipe.domain.grid_spacing = 0.04;
    CHECK(scallop_note(recipe, Json{{"scallop_pitch", 0.39}, {"depth", 3.9}}).empty());
    recipe.steps[0].steps.clear();
    CHECK(scallop_note(recipe, Json{{"scallop_pitch", 0.226}, {"depth", 3.94}}).empty());
}
