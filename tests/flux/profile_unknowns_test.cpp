#include <catch2/catch.hpp>
#include <cmath>

#include "flux/radiosity/radiosity.hpp"
#include "tests/flux/flux_checks.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/flux/trench_table.hpp"

// Profiles: surfaces of infinite trenches, one triangle wide from side to side and periodic along y.
using namespace sidewall;
using namespace sidewall::flux;

TEST_CASE("the width of a profile's surface changes neither its fluxes nor what its flights cost") {
    const double sticking = GENERATE(1.0, 0.1);
    const Species species{"test", 1.0, {sticking}};
    const std::array<Boundary, 2> boundary{Boundary::reflective, Boundary::periodic};
    const auto narrow = extrude(trench_profile(2.0, 0.5, kCuts, kCuts), 0.02);
    const auto wide = extrude(trench_profile(2.0, 0.5, kCuts, kCuts), 2.0);
    const auto a = trace(narrow, boundary, species, {.rays = 50'000}),
               b = trace(wide, boundary, species, {.rays = 50'000});
    CHECK(a.leaked == 0);
    CHECK(b.leaked == 0);
    CHECK(a.absorbed + a.escaped == a.emitted);
    // The same random numbers give the same paths in x and z, but for rounding that grows from hit to hit.
    CHECK(static_cast<double>(a.segments) == Approx(static_cast<double>(b.segments)).epsilon(0.01));
    for (std::size_t t = 0; t < narrow.triangles.size(); ++t) {
        CAPTURE(sticking, t);
        const double error = std::hypot(a.triangle.error[t], b.triangle.error[t]);
        CHECK(std::abs(a.triangle.flux[t] - b.triangle.flux[t]) < 4.6 * error);
    }
}

TEST_CASE("radiosity of a profile has an unknown a point, one flux along y, and rays that cross no side") {
    const std::array<Boundary, 2> boundary{Boundary::reflective, Boundary::periodic};
    const auto gathered = [&](double width) {
        const TriangleMesh mesh = extrude(trench_profile(2.0, 0.5, kCuts, kCuts), width);
        const surface::RayScene scene(mesh);
        const Wedges wedges = make_wedges(mesh);
        Exchange exchange(mesh, scene, lateral_box(mesh, boundary), wedges, {1.0});
        CHECK(2 * exchange.unknowns() == wedges.count());
        exchange.gather(20'000);
        CHECK(exchange.leaked() == 0);
        const std::vector<double> sticking(wedges.count(), 0.1);
        const RadiosityFlux flux = solve_flux(exchange, {.sticking = sticking});
        std::size_t edges = 0;  // along y, two a segment
        for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
            const std::size_t next = c % 3 == 2 ? c - 2 : c + 1;
            const Vec3 along = mesh.vertices[mesh.triangles[c / 3][c % 3]] -
                               mesh.vertices[mesh.triangles[next / 3][next % 3]];
            if (std::hypot(along.x(), along.z()) > 0.0) continue;
            ++edges;
            CHECK(flux.wedge.flux[wedges.corner[c]] == flux.wedge.flux[wedges.corner[next]]);
        }
        CHECK(edges == mesh.triangles.size());
        return exchange.segments();
    };
    CHECK(static_cast<double>(gathered(0.02)) == Approx(static_cast<double>(gathered(2.0))).epsilon(0.03));
}

TEST_CASE("the mean fluxes on a profile are those of exact radiosity") {
    const auto mesh = extrude(trench_profile(2.0, 0.5, kCuts, kCuts), 0.05);
    for (const double sticking : {1.0, 0.1}) {
        const auto result = trace(mesh, {Boundary::reflective, Boundary::periodic}, {"test", 1.0, {sticking}},
                                  {.rays = 400'000});
        for (const Row& row : radiosity_rows()) {
            if (row.aspect != 2.0 || row.sticking != sticking || row.position >= 0.0) continue;
            const auto group = triangles_of(mesh, row);
            REQUIRE(!group.empty());
            const Mean mean = mean_flux(mesh, result, [&](std::size_t t) {
                return std::find(group.begin(), group.end(), t) != group.end();
            });
            CAPTURE(sticking, row.where, row.flux, mean.flux, mean.error);
            // Re-emitted particles arrive several times, so that triangles are correlated.
            CHECK(std::abs(mean.flux - row.flux) < 4.0 * mean.error * (sticking < 1.0 ? 3.0 : 1.0));
            CHECK(std::abs(mean.flux - row.flux) < 0.01 * row.flux);
        }
    }
}
