#include "flux/tracer/gas_collisions.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>

#include "flux/radiosity/method_choice.hpp"
#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"

// Particles that collide in the gas on their way.
using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;

namespace {

Species in_gas(double mean_free_path, double sticking = 1.0) {
    Species species{"gas", 1.0, {sticking}};
    species.mean_free_path = mean_free_path;
    return species;
}

// A floor \p depth below the source with walls at both ends, in the planes of the sides. The ends are so far
// away that the middle receives what an infinite slab transmits.
TriangleMesh basin(double width, double depth = 1.0) {
    return extrude({{0.0, 0.0},
                    {0.0, -depth},
                    {0.25 * width, -depth},
                    {0.75 * width, -depth},
                    {width, -depth},
                    {width, 0.0}},
                   1.0);
}

Mean middle_of(const TriangleMesh& mesh, const FluxResult& result) {
    return mean_flux(mesh, result, [](std::size_t t) { return t == 4 || t == 5; });
}

}  // namespace

TEST_CASE("a collimated beam's uncollided part falls as exp(-depth / mean free path)") {
    const auto sides = GENERATE(std::array{Boundary::reflective, Boundary::reflective},
                                std::array{Boundary::periodic, Boundary::periodic},
                                std::array{Boundary::open, Boundary::open});
    const auto mesh = basin(20.0, 1.5);
    // This yield is 1 within 0.3 degrees of the normal: it counts the whole beam and 1e-5 of the collided.
    Species beam{"beam", 1e6, {1.0}};
    Yield straight{"straight", Angular::table, 0.0, {1.0}, std::vector<double>(1801, 0.0)};
    std::fill_n(straight.coefficient.begin(), 7, 1.0);
    beam.yields = {straight};
    for (const double path : {5.0, 1.0, 0.5}) {
        beam.mean_free_path = path;
        const FluxResult result = trace(mesh, sides, beam, {.rays = 100'000});
        CHECK(result.leaked == 0);
        FluxResult uncollided;
        static_cast<TallyFlux&>(uncollided) = result.others[0];
        const double exact = std::exp(-1.5 / path), share = middle_of(mesh, uncollided).flux;
        CAPTURE(path, share, exact);
        CHECK(std::abs(share - exact) < 4.5 * std::sqrt(exact * (1.0 - exact) / 50'000));
    }
}

TEST_CASE("a slab of gas transmits what the equation of transfer says, up to many collisions") {
    // Isotropic scattering without absorption between a Lambertian source and an absorbing wall: a Fredholm
    // equation with the kernel E1(|t - t'|)/2, solved to 1e-5; Heaslet and Warming, Int. J. Heat Mass
    // Transfer 8, 979 (1965). Above 5 it is diffusion: 4/3 / (t + 1.42089).
    struct Slab {
        double thickness, transmission;
    };
    const auto sides = GENERATE(std::array{Boundary::reflective, Boundary::periodic},
                                std::array{Boundary::reflective, Boundary::reflective},
                                std::array{Boundary::periodic, Boundary::periodic});
    const auto mesh = basin(40.0);
    for (const Slab slab :
         {Slab{0.5, 0.70417}, {1.0, 0.55341}, {2.0, 0.39006}, {5.0, 0.20766}, {10.0, 0.11675}}) {
        const FluxResult result = trace(mesh, sides, in_gas(1.0 / slab.thickness), {.rays = 100'000});
        check_balance(result);
        const double share = middle_of(mesh, result).flux, exact = slab.transmission;
        CAPTURE(slab.thickness, share, exact);
        // 4.5 standard errors, for the 50,000 particles that start over the middle.
        CHECK(std::abs(share - exact) < 4.5 * std::sqrt(exact * (1.0 - exact) / 50'000));
    }
}

TEST_CASE("a closed equilibrium with the gas: nothing absorbed means flux 1 everywhere, whatever the shape") {
    // Collisions leave an isotropic gas isotropic.
    const auto side = GENERATE(Boundary::reflective, Boundary::periodic);
    const double path = GENERATE(3.0, 0.4);
    const auto mesh = extrude(trench_profile(3.0, 0.1, {0.25, 0.5, 0.75}, {0.5}), 0.7, 2);
    const FluxResult result = trace(mesh, {side, side}, in_gas(path, 0.0), {.rays = 100'000});
    check_balance(result);
    double worst = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        worst = std::max(worst, std::abs(result.triangle.flux[t] - 1.0) / result.triangle.error[t]);
    CHECK(worst < 5.0);  // for 40 values of Student's t in 4 configurations
    CHECK(std::abs(mean_flux(mesh, result, [](std::size_t) { return true; }).flux - 1.0) < 0.02);
}

TEST_CASE("species in the same gas share paths, and have the fluxes they have alone") {
    const auto mesh = extrude(trench_profile(2.0, 0.5, {0.5}, {0.5}), 1.0);
    const surface::RayScene scene(mesh);
    const auto box = lateral_box(mesh, kPeriodic);
    const auto wedges = make_wedges(mesh);
    const std::vector<Species> species{
        in_gas(0.5, 0.2), in_gas(0.5, 1.0), in_gas(1.0, 1.0), {"free", 1.0, {1.0}}};
    CHECK(passes_of(species) == std::vector<std::vector<std::size_t>>{{0, 1}, {2}, {3}});
    const TraceOptions options{.rays = 60'000};
    const auto together = trace_fluxes(mesh, scene, box, species, {}, wedges, options);
    for (std::size_t k = 0; k < 2; ++k) {
        const FluxResult alone = trace_flux(mesh, scene, box, species[k], {}, wedges, options);
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const double error = std::hypot(alone.triangle.error[t], together[k].triangle.error[t]);
            CHECK(std::abs(alone.triangle.flux[t] - together[k].triangle.flux[t]) < 5.0 * error);
        }
    }
    // On the floor, less arrives the shorter the mean free path.
    const auto floor = [&](std::size_t k) {
        return mean_flux(mesh, together[k], [](std::size_t t) { return t >= 6 && t < 10; }).flux;
    };
    CHECK(floor(1) < floor(2));
    CHECK(floor(2) < floor(3));
}

TEST_CASE("a gas too dense to follow ends as leaked, counted, and not as an endless trace") {
    const auto mesh = basin(4.0);
    const FluxResult result = trace(mesh, kPeriodic, in_gas(0.01), {.rays = 2000, .max_bounces = 100});
    CHECK(result.leaked > 0);
    CHECK(result.ledger.balanced());
    CHECK(result.emitted == result.absorbed + result.escaped + result.leaked);
    std::atomic<int> asked = 0;
    TraceOptions options{.rays = 2000};
    options.stop = [&] { return asked++ > 100; };
    CHECK_THROWS_AS(trace(mesh, kPeriodic, in_gas(1e-4), options), Interrupted);
}

TEST_CASE("a mean free path is for thermal species, and keeps them from radiosity") {
    const auto mesh = basin(4.0);
    CHECK(why_not_radiosity(in_gas(1.0)) == "its particles collide in the gas");
    CHECK(why_not_radiosity({}).empty());
    CHECK_THROWS_WITH(trace(mesh, kPeriodic, in_gas(0.0), {}),
                      Contains("mean_free_path = 0: must be above 0"));
    CHECK_THROWS_WITH(trace(mesh, kPeriodic, in_gas(std::nan("")), {}), Contains("mean_free_path"));
    Species ions = ion("ion");
    ions.mean_free_path = 1.0;
    CHECK_THROWS_WITH(trace(mesh, kPeriodic, ions, {}), Contains("without energy"));
}
