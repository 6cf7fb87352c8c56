#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "app/process/simulation.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "tests/integration/run_program.hpp"

// Speeds that depend on the surface's normal, against exact solutions.
using namespace sidewall;

namespace {

app::RunResult run_text(const std::string& text, const std::vector<std::string>& overrides) {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(text, "angles.toml", overrides);
    return app::run_recipe(recipe, {.output = folder.path, .quiet = true});
}

// The least and the largest x at which the surface has height z.
std::pair<double, double> sides_at(const TriangleMesh& mesh, double z) {
    double left = 1e30, right = -1e30;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 &a = mesh.vertices[t[k]], &b = mesh.vertices[t[(k + 1) % 3]];
            if ((a.z() - z) * (b.z() - z) > 0.0 || a.z() == b.z()) continue;
            const double x = a.x() + (z - a.z()) / (b.z() - a.z()) * (b.x() - a.x());
            left = std::min(left, x), right = std::max(right, x);
        }
    return {left, right};
}

const char* kFacet = R"([domain]
extent = [8.0]
boundary = ["periodic", "periodic"]
[[layer]]
material = "Si"
shape = "trench"
width = 2.0
depth = 4.0
[[step]]
model = "ion_beam"
duration = 0.5
rate = 1.0
reflect_from_deg = 89.0
ion_exponent = 100000
[flux]
rays = 20_000
)";

const char* kFlat = R"([domain]
extent = [1.0]
grid_spacing = 0.1
boundary = ["periodic", "periodic"]
[[layer]]
material = "Si"
[[step]]
model = "ion_beam"
duration = 1.0
rate = 1.0
[flux]
rays = 100_000
)";

}  // namespace

// The height h obeys h_t + F(h_x) = 0 with F(p) = (1 + 9.3 s) / sqrt(1 + p^2), s = p^2 / (1 + p^2):
// characteristics from the edge reach x = 1 + F'(q) t at z = -(F(q) - q F'(q)) t.
TEST_CASE("facets of a trench's two edges are those of the characteristics, left and right") {
    const std::string spacing = GENERATE("0.1", "0.0964", "0.05");
    const auto run = run_text(kFacet, {"domain.grid_spacing=" + spacing});
    const double bound = 0.5 * std::stod(spacing);
    for (const auto& [z, x] : {std::pair(-0.713, 2.370), {-1.0, 2.021}, {-1.4, 1.598}, {-1.8, 1.231}}) {
        const auto [left, right] = sides_at(run.surface, z);
        INFO(spacing << " at " << z << ": " << left << " " << right);
        CHECK(-left == Approx(x).margin(bound));
        CHECK(right == Approx(x).margin(bound));
    }
}

// What a beam of speed V(n) leaves of a corner between planes is what lies behind all planes n . p = -V(n) t
// (Hopf's formula). This yield peaks at 70 degrees; the foot of its facet moves at 2.15 times the largest V.
TEST_CASE("a steep facet of a yield that peaks at 70 degrees is that of Hopf's formula down to its foot") {
    constexpr int kAngles = 90;
    constexpr double kTime = 0.5;
    std::vector<double> yield;
    std::string table;
    for (int degree = 0; degree <= kAngles; ++degree) {
        const double u = 1.0 / std::cos(std::numbers::pi / 180.0 * std::min(degree, 89));
        yield.push_back(degree < kAngles ? u * u * std::exp(-0.684 * (u - 1.0)) : 0.0);
        table += fmt::format("{}{:.8f}", degree > 0 ? "," : "", yield.back());
    }
    // Distance of the point at \p x beyond the edge from what is left of the wafer, positive outside.
    const auto distance = [&](double x, double z) {
        double most = -1e30;
        for (int n = 0; n <= 100 * kAngles; ++n) {
            const double degree = 0.01 * n, angle = std::numbers::pi / 180.0 * degree;
            const auto low = static_cast<std::size_t>(std::min(degree, kAngles - 1.0));
            const double y = yield[low] + (degree - static_cast<double>(low)) * (yield[low + 1] - yield[low]);
            most = std::max(most, -std::sin(angle) * x + std::cos(angle) * z + kTime * y * std::cos(angle));
        }
        return most;
    };
    for (const auto& [dx, half_width] : {std::pair(0.1, 1.0), {0.1, 1.03}, {0.05, 1.0}, {0.05, 1.025}}) {
        const auto run = run_text(kFacet, {fmt::format("domain.grid_spacing={}", dx),
                                           fmt::format("layer[0].width={}", 2.0 * half_width),
                                           "step[0].yield_table=[" + table + "]"});
        for (const double z : {-0.6, -0.8, -1.0, -1.1}) {
            const auto [left, right] = sides_at(run.surface, z);
            INFO(dx << ", half width " << half_width << ", at " << z << ": " << left << " " << right);
            CHECK(std::abs(distance(right - half_width, z)) < 0.4 * dx);
            CHECK(std::abs(distance(-left - half_width, z)) < 0.4 * dx);
        }
    }
}

// The flux on a flat wafer does not depend on its height, and `rate` is a flat wafer's.
TEST_CASE("a flat wafer under a tilted beam stays flat and is as deep as its rate says") {
    const std::string tilt = GENERATE("0", "45", "80", "85"), cfl = GENERATE("0.5", "0.2");
    const auto run = run_text(kFlat, {"step[0].tilt_deg=" + tilt, "advection.cfl=" + cfl});
    double low = 0.0, high = -10.0;
    for (const Vec3& p : run.surface.vertices) low = std::min(low, p.z()), high = std::max(high, p.z());
    INFO(tilt << " " << cfl << ": " << low << " " << high);
    CHECK(0.5 * (low + high) == Approx(-1.0).margin(5e-3));
    CHECK(high - low <= 0.01);
}

// A rotating beam sputters both edges of a trench equally.
TEST_CASE("facets under a turning tilted beam are the same on both sides") {
    const auto run =
        run_text(kFacet, {"domain.grid_spacing=0.1", "step[0].tilt_deg=30", "step[0].rotating=true",
                          "step[0].duration=0.3", "step[0].ion_exponent=1000"});
    for (const double z : {-0.5, -0.8}) {
        const auto [left, right] = sides_at(run.surface, z);
        CHECK(right > 1.03);
        CHECK(right + left == Approx(0.0).margin(0.03));
    }
}

// A gas etches under the mask from the first moment, whether ions come with it or not.
TEST_CASE("the undercut of a mask under a gas and ions does not depend on the grid") {
    const std::string yield = GENERATE("none", "sputter");
    const std::string recipe = R"([domain]
extent = [4.0]
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "trench"
thickness = 0.4
width = 1.0
[[step]]
model = "multi_particle"
duration = 1.0
species = [ { name = "gas", sticking = 0.01, rate = { Si = -0.6 } }, { name = "ion", kind = "ion", rate = { Si = -0.3 }, yield = ")" +
                               yield + R"(" } ]
[flux]
rays = 50_000
[metrology]
measures = ["undercut"]
)";
    const auto undercut = [&](const std::string& spacing) {
        return run_text(recipe, {"domain.grid_spacing=" + spacing})
            .summary["metrology"]["undercut"]
            .get<double>();
    };
    CHECK(undercut("0.1") == Approx(undercut("0.05")).margin(0.02));
}

// The mask is a fin 3 cells wide. Ions reach it from both sides at slants of some 8 degrees.
TEST_CASE("a mask is undercut at a periodic or mirrored side as far as in the middle") {
    const std::string recipe = R"([domain]
extent = [4.0]
grid_spacing = 0.1
boundary = ["periodic", "periodic"]
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "trench"
thickness = 1.0
width = 3.7
[[step]]
model = "multi_particle"
duration = 0.25
species = [ { name = "gas", sticking = 0.01, rate = { Si = -0.6 } }, { name = "ion", kind = "ion", rate = { Si = -0.3 }, source_exponent = 50 } ]
[flux]
rays = 20_000
[metrology]
measures = ["undercut"]
)";
    const auto undercut = [&](const std::string& set) {
        return run_text(recipe, {set}).summary["metrology"]["undercut"].get<double>();
    };
    const double middle = undercut("layer[1].position=[2.0, 0.0]");
    CHECK(undercut("layer[1].position=[0.0, 0.0]") == Approx(middle).margin(0.01));
    CHECK(undercut(R"(domain.boundary=["reflective", "periodic"])") == Approx(middle).margin(0.01));
}

// The beam leans by 30 degrees, so that the mask's left wall hides 0.3 tan(30) of its opening of 1. What is
// lit sinks along the beam: a parallelogram. Walls are to be right to 0.4 cells in the mean over a depth of
// 0.5.
TEST_CASE("a tilted beam under a mask removes the parallelogram that it sees") {
    const std::string rate = GENERATE("0.0", "-0.001");
    const auto [spacing, shift] = GENERATE(table<double, double>(
        {{0.1, 0.0}, {0.1, 0.6}, {0.05, 0.0}, {0.05, 0.3}, {0.05, 0.6}, {0.05, 0.9}, {0.025, 0.3}}));
    CAPTURE(rate, spacing, shift);
    const app::RunResult run = run_text(R"([domain]
extent = [6.0]
boundary = ["periodic", "periodic"]
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "trench"
thickness = 0.3
width = 1.0
[[step]]
model = "directional"
duration = 0.5773502691896257
directional = { Si = -1.0, Mask = )" + rate +
                                            R"( }
direction = [-0.5, 0.0, 0.8660254037844386]
)",
                                        {fmt::format("domain.grid_spacing={}", spacing),
                                         fmt::format("layer[1].position=[{}, 0.0]", shift * spacing)});
    const double exact = 0.5 * (1.0 - 0.3 * std::tan(std::numbers::pi / 6.0));
    CHECK(-run.summary["volumes"]["Si"]["net"].get<double>() == Approx(exact).margin(0.4 * 0.5 * spacing));
}
