#include "app/flux_reuse.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace sidewall;
using namespace sidewall::app;

namespace {

// Two triangles under a flux that is linear in x, times a factor, known to within a share of itself.
SurfaceFlux square(double factor, double error) {
    SurfaceFlux surface;
    surface.raw.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    surface.raw.triangles = {{0, 1, 2}, {0, 2, 3}};
    surface.wedges = flux::make_wedges(surface.raw);
    flux::FluxResult species;
    for (const Vec3& p : surface.raw.vertices) {
        species.wedge.flux.push_back(factor * (1.0 + p.x()));
        species.wedge.error.push_back(error * factor * (1.0 + p.x()));
    }
    surface.wedge_flux = {species.wedge.flux};
    surface.wedge_error = {species.wedge.error};
    surface.fluxes = {species};
    return surface;
}

Model neutral_model() {
    Model model;
    flux::Species neutral;
    neutral.name = "neutral";
    model.species = {neutral};
    return model;
}

}  // namespace

TEST_CASE("fluxes that grew by a tenth have changed by a tenth, unless their errors explain it") {
    const Model model = neutral_model();
    const CoverageField before = flux_field(model, square(1.0, 0.0));
    CHECK(flux_change(model, before, square(1.0, 0.0)) == Approx(0.0).margin(1e-12));
    CHECK(flux_change(model, before, square(1.25, 0.0)) == Approx(0.25 / 1.25));
    CHECK(flux_change(model, before, square(1.25, 0.2)) == 0.0);
    const double noise = 0.1 * 2.0 / std::sqrt(std::numbers::pi);
    CHECK(flux_change(model, before, square(1.25, 0.1)) == Approx(std::sqrt(0.04 - noise * noise)));
}

TEST_CASE("a surface takes the fluxes of the closest points") {
    const Model model = neutral_model();
    SurfaceFlux moved = square(0.0, 0.0);
    for (Vec3& p : moved.raw.vertices) p.z() += 0.01;
    take_fluxes(model, flux_field(model, square(2.0, 0.0)), moved);
    REQUIRE(moved.wedge_flux.size() == 1);
    CHECK(moved.coverage.empty());
    // The look-up starts a tenth of the way from the wedge's vertex to its fan's middle.
    for (std::size_t v = 0; v < 4; ++v)
        CHECK(moved.wedge_flux[0][v] == Approx(2.0 * (1.0 + moved.raw.vertices[v].x())).margin(2.0 * 0.07));
}

TEST_CASE("fluxes serve as many time steps as their change allows") {
    CHECK(steps_within(0.1, 0.02, 1) == 5);
    CHECK(steps_within(0.1, 0.02, 2) == 8);
    CHECK(steps_within(0.1, 0.0, 3) == 8);
    CHECK(steps_within(0.1, 0.5, 1) == 0);
    CHECK(steps_within(0.1, 0.02, 0) == 0);
}
