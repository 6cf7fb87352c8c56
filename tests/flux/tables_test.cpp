#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "flux/radiosity/radiosity.hpp"
#include "tests/flux/cavity.hpp"
#include "tests/flux/cylinders.hpp"
#include "tests/flux/extracted.hpp"
#include "tests/flux/flux_checks.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/trench_table.hpp"
#include "tests/flux/truth.hpp"

// Radiosity compared with every row of the tables of exact fluxes, on surfaces extracted by marching cubes
// with 10 cells a radius or half a width.

using namespace sidewall;
using namespace sidewall::flux;

namespace {

// The required accuracy: 2 %, or 5 % where hardly anything arrives. Marching cubes' rims and linear elements
// take up to 1.7 %; the noise of the mean of two gathers seldom takes the rest.
double tolerance(double exact) {
    return exact < 1e-3 ? 0.05 : 0.02;
}

// Mean of two gathers' fluxes on the triangles.
std::vector<double> mean_flux(const Cavity& cavity, const std::array<Exchange, 2>& exchanges,
                              double sticking) {
    const std::vector<double> everywhere(cavity.wedges.count(), sticking);
    std::vector<double> mean(cavity.mesh.triangles.size(), 0.0);
    for (const Exchange& exchange : exchanges) {
        const RadiosityFlux flux = solve_flux(exchange, {.sticking = everywhere}, {.errors = false});
        for (std::size_t t = 0; t < mean.size(); ++t) mean[t] += 0.5 * flux.triangle.flux[t];
    }
    return mean;
}

std::array<Exchange, 2> two_gathers(const Cavity& cavity, std::uint64_t rays_of_unknown) {
    return {cavity.gathered(rays_of_unknown, 1), cavity.gathered(rays_of_unknown, 2)};
}

// Unknowns of a raw mesh over those of the simplified one, about.
constexpr std::uint64_t kMoreUnknowns = 5;

TriangleMesh raw_or_simplified(const TriangleMesh& mesh, bool raw, double dx) {
    return raw ? mesh : simplified(mesh, dx);
}

}  // namespace

TEST_CASE("the cylinder quadrature that tests integrate agrees with the table of exact fluxes", "[slow]") {
    const auto rows = cylinder_rows();
    REQUIRE(rows.size() == 176);
    for (const CylinderRow& row : rows) {
        static std::map<std::pair<double, double>, CylinderTruth> truths;
        const auto& truth =
            truths.try_emplace({row.aspect, row.sticking}, 2.0 * row.aspect, row.sticking).first->second;
        const double value = row.depth < 0.0 ? truth.floor() : truth.wall(-2.0 * row.aspect * row.depth);
        CAPTURE(row.aspect, row.sticking, row.depth, row.flux, value);
        CHECK(value == Approx(row.flux).epsilon(0.001));  // as exact as the table
    }
}

TEST_CASE("radiosity in an extracted hole, raw or simplified, has the exact flux at every depth", "[slow]") {
    const auto [aspect, rays] =
        GENERATE(table<double, std::uint64_t>({{5.0, 2000}, {10.0, 1600}, {30.0, 1200}, {100.0, 1200}}));
    const bool raw = GENERATE(false, true);
    const double depth = 2.0 * aspect;
    const Cavity cavity(raw_or_simplified(extracted_hole(depth, 10), raw, 0.1), kReflective);
    const auto exchanges = two_gathers(cavity, raw ? rays / kMoreUnknowns : rays);
    int rows = 0;
    for (const double sticking : {1.0, 0.1, 0.01, 0.001}) {
        const CylinderTruth truth(depth, sticking);
        const std::vector<double> flux = mean_flux(cavity, exchanges, sticking);
        for (const CylinderRow& row : cylinder_rows()) {
            if (row.aspect != aspect || row.sticking != sticking) continue;
            const int tenth = row.depth < 0.0 ? 10 : static_cast<int>(10.0 * row.depth);
            CAPTURE(aspect, sticking, raw, row.depth, row.flux);
            CHECK(tenth_ratio(cavity.mesh, flux, truth, depth, tenth) ==
                  Approx(1.0).epsilon(tolerance(row.flux)));
            ++rows;
        }
    }
    CHECK(rows == 44);
}

TEST_CASE("radiosity in an extracted trench, raw or simplified, has the exact flux of every position",
          "[slow]") {
    const double aspect = GENERATE(1.0, 2.0, 5.0);
    const bool raw = GENERATE(false, true);
    const Cavity cavity(raw_or_simplified(extracted_trench(aspect), raw, 0.05), kReflective);
    const auto exchanges = two_gathers(cavity, raw ? 1000 / kMoreUnknowns : 1000);
    int rows = 0;
    for (const double sticking : {1.0, 0.5, 0.1}) {
        const TrenchFlux exact = trench_flux(aspect, sticking, 400, 100);
        const std::vector<double> flux = mean_flux(cavity, exchanges, sticking);
        for (const Row& row : radiosity_rows()) {
            if (row.aspect != aspect || row.sticking != sticking) continue;
            const std::vector<std::size_t> group = triangles_of(cavity.mesh, row);
            CAPTURE(aspect, sticking, raw, row.where, row.position, row.flux);
            REQUIRE_FALSE(group.empty());
            double sum = 0.0, area = 0.0;
            for (const std::size_t t : group) {
                sum += triangle_area(cavity.mesh, t) * flux[t];
                area += triangle_area(cavity.mesh, t);
            }
            const double truth = mean_over(cavity.mesh, group, [&](const Vec3& p) {
                return row.where.starts_with("wall") ? at_position(exact.wall, -p.z() / aspect)
                                                     : at_position(exact.floor, p.x() + 0.5);
            });
            CHECK(sum / area / truth == Approx(1.0).epsilon(tolerance(row.flux)));
            ++rows;
        }
    }
    CHECK(rows == 30);
}
