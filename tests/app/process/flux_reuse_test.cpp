#include "app/process/arriving/surface_field.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace sidewall;
using namespace sidewall::app;

namespace {

// Two triangles under a flux of factor (1 + x) with the relative standard deviation `error`.
TracedSurface square(double factor, double error) {
    TracedSurface surface;
    surface.raw.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    surface.raw.triangles = {{0, 1, 2}, {0, 2, 3}};
    SurfaceFlux& arriving = surface.arriving.emplace();
    arriving.wedges = flux::make_wedges(surface.raw);
    std::vector<double>& flux = arriving.flux.emplace_back();
    std::vector<double>& sigma = arriving.trace.emplace().error.emplace_back();
    for (const Vec3& p : surface.raw.vertices) {
        flux.push_back(factor * (1.0 + p.x()));
        sigma.push_back(error * factor * (1.0 + p.x()));
    }
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
    const SurfaceField before = flux_field(model, square(1.0, 0.0));
    CHECK(flux_change(model, before, square(1.0, 0.0)) == Approx(0.0).margin(1e-12));
    CHECK(flux_change(model, before, square(1.25, 0.0)) == Approx(0.25 / 1.25));
    CHECK(flux_change(model, before, square(1.25, 0.2)) == 0.0);
    const double noise = 0.1 * 2.0 / std::sqrt(std::numbers::pi);
    CHECK(flux_change(model, before, square(1.25, 0.1)) == Approx(std::sqrt(0.04 - noise * noise)));
}

TEST_CASE("a surface takes the fluxes of the closest points") {
    const Model model = neutral_model();
    TriangleMesh mesh = square(0.0, 0.0).raw;
    for (Vec3& p : mesh.vertices) p.z() += 0.01;
    SurfaceFlux parts;
    parts.wedges = flux::make_wedges(mesh);
    const SurfaceFlux moved = carried_fluxes(model, flux_field(model, square(2.0, 0.0)), mesh, {}, parts);
    REQUIRE(moved.flux.size() == 1);
    CHECK(moved.coverage.empty());
    CHECK_FALSE(moved.trace);
    // Values are read at a tenth of the distance from the wedge's vertex to the middle of its fan.
    for (std::size_t v = 0; v < 4; ++v)
        CHECK(moved.flux[0][v] == Approx(2.0 * (1.0 + mesh.vertices[v].x())).margin(2.0 * 0.07));
}

TEST_CASE("fluxes serve as many time steps as their change allows") {
    CHECK(time_steps_within(0.1, 0.02, 1) == 5);
    CHECK(time_steps_within(0.1, 0.02, 2) == 8);
    CHECK(time_steps_within(0.1, 0.0, 3) == 8);
    CHECK(time_steps_within(0.1, 0.5, 1) == 0);
    CHECK(time_steps_within(0.1, 0.02, 0) == 0);
}
