#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "tests/flux/flux_checks.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/trench_table.hpp"
#include "tests/flux/truth.hpp"

using namespace sidewall;
using namespace sidewall::flux;

TEST_CASE("an open plane receives flux 1 whatever the source, the sides and the sticking") {
    const double exponent = GENERATE(1.0, 10.0, 1000.0);
    const auto boundary = GENERATE(Boundary::reflective, Boundary::periodic);
    const double sticking = GENERATE(1.0, 0.2);
    const auto mesh = height_field(3, 2, std::sqrt(2.0), 1.1, [](auto, auto) { return 0.3; });
    const auto result = trace(mesh, {boundary, boundary}, {"test", exponent, {sticking}}, {.rays = 200'000});
    CHECK(result.leaked == 0);
    CHECK(result.escaped + result.absorbed == result.emitted);
    // All rays hit exactly once: a plane does not see itself.
    CHECK(result.arrivals == result.emitted);
    const Mean all = mean_flux(mesh, result, [](std::size_t) { return true; });
    CHECK(all.flux == Approx(1.0).epsilon(1e-12));
    double squares = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double z = (result.triangle.flux[t] - 1.0) / result.triangle.error[t];
        CAPTURE(t, result.triangle.flux[t], result.triangle.error[t]);
        // 12 triangles in 12 configurations: Student's t of 31 degrees of freedom stays below 4.6 in all but
        // 1 of 100.
        CHECK(std::abs(z) < 4.6);
        squares += z * z;
    }
    CHECK(squares < 12.0 + 5.0 * std::sqrt(2.0 * 12.0));
}

TEST_CASE("the trench quadrature that tests integrate agrees with the radiosity table", "[slow]") {
    const auto rows = radiosity_rows();
    REQUIRE(rows.size() == 90);
    for (const double aspect : {1.0, 2.0, 5.0})
        for (const double sticking : {1.0, 0.5, 0.1}) {
            const TrenchFlux exact = trench_flux(aspect, sticking, 400, 100);
            for (const Row& row : rows) {
                if (row.aspect != aspect || row.sticking != sticking) continue;
                const double value =
                    row.position < 0.0
                        ? exact_mean(exact, row)
                        : at_position(row.where == "wall" ? exact.wall : exact.floor, row.position);
                CAPTURE(aspect, sticking, row.where, row.position, row.flux, value);
                CHECK(std::abs(value - row.flux) < 5.1e-6 + 2e-4 * row.flux);  // table's digits; strips
            }
        }
}

TEST_CASE("flux in an infinite trench agrees with exact radiosity on every wall and floor position",
          "[slow]") {
    const auto rows = radiosity_rows();
    // The three aspect ratios also exercise the three ways to close the sides.
    struct Case {
        double aspect;
        std::array<Boundary, 2> boundary;
        bool along_x;
    };
    Comparison comparison;
    std::uint32_t stream = 0;
    for (const Case& c : {Case{1.0, {Boundary::periodic, Boundary::periodic}, false},
                          Case{2.0, {Boundary::reflective, Boundary::periodic}, false},
                          Case{5.0, {Boundary::periodic, Boundary::reflective}, true}}) {
        const auto mesh = extrude(trench_profile(c.aspect, 0.01, kCuts, kCuts), 2.0);
        for (const double sticking : {1.0, 0.5, 0.1}) {
            const TrenchFlux exact = trench_flux(c.aspect, sticking, 400, 100);
            std::vector<Row> chosen;
            Groups groups;
            for (const Row& row : rows)
                if (row.aspect == c.aspect && row.sticking == sticking) {
                    chosen.push_back(row);
                    groups.push_back(triangles_of(mesh, row));
                }
            // Enough rays for the least flux, at the foot of the walls.
            const double rays = sticking == 1.0 ? 5e6 * c.aspect : sticking == 0.5 ? 1.2e7 : 5e6;
            const auto means =
                over_seeds(c.along_x ? turned(mesh) : mesh, c.boundary, {"test", 1.0, {sticking}},
                           static_cast<std::uint64_t>(rays), stream++, groups);
            for (std::size_t i = 0; i < means.size(); ++i) {
                CAPTURE(c.aspect, sticking, chosen[i].where, chosen[i].position);
                comparison.check(means[i], exact_mean(exact, chosen[i]));
            }
        }
    }
    comparison.verdict();
}

TEST_CASE("a cylinder transmits what Clausing computed") {
    // Walls reflect, the floor absorbs: the mean flux on the floor is the transmission probability. Clausing
    // (1932); Cole, Prog. Astronaut. Aeronaut. 51 (1977) 261.
    const auto [length, transmission] =
        GENERATE(table<double, double>({{0.5, 0.80127}, {1.0, 0.67198}, {2.0, 0.51423}, {4.0, 0.35657}}));
    const auto hole = round_hole(1.0, length, 1.02, 64, 0.5);
    const auto result = trace(hole.mesh, {Boundary::reflective, Boundary::reflective},
                              {"test", 1.0, {1.0, 0.0, 1.0, 1.0}}, {.rays = 1'000'000}, hole.materials);
    CHECK(result.leaked == 0);
    const Mean floor = mean_flux(hole.mesh, result, [&](std::size_t t) { return hole.materials[t] >= 2; });
    CAPTURE(length, floor.flux, floor.error);
    CHECK(std::abs(floor.flux - transmission) < 0.01 * transmission);
    // A sharper bound: a polygon of n sides has the circle's area but a perimeter longer by (pi / n)^2 / 6 =
    // 4e-4, which acts like a cylinder longer by as much; the transmission changes by less than that.
    CHECK(std::abs(floor.flux - transmission) < 3.5 * floor.error + 5e-4 * transmission);
}

TEST_CASE("the floor centre of a cylinder of sticking 1 sees the view factor of its opening", "[slow]") {
    const double depth = GENERATE(1.0, 3.0);
    // Disk to parallel coaxial disk (Howell, configuration factor C-41); its limit for a small core is the
    // centre's.
    const auto view_from = [depth](double core) {
        const double r1 = core / depth, r2 = 1.0 / depth, x = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
        return 0.5 * (x - std::sqrt(x * x - 4.0 * (r2 / r1) * (r2 / r1)));
    };
    CHECK(view_from(1e-3) == Approx(1.0 / (1.0 + depth * depth)).epsilon(1e-5));
    constexpr double kCore = 0.4;
    const double view = view_from(kCore);
    const auto hole = round_hole(1.0, depth, 1.1, 64, kCore);
    const auto result = trace(hole.mesh, {Boundary::periodic, Boundary::periodic}, {"test", 1.0, {1.0}},
                              {.rays = 24'000'000}, hole.materials);
    const Mean mean = mean_flux(hole.mesh, result, [&](std::size_t t) { return hole.materials[t] == 2; });
    CAPTURE(depth, view, mean.flux, mean.error);
    CHECK(mean.error < 0.0025 * view);
    CHECK(std::abs(mean.flux - view) < 0.005 * view);
    CHECK(std::abs(mean.flux - view) < 3.5 * mean.error + 5e-4 * view);  // facets as above
}
