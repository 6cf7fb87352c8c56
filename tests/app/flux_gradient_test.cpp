#include "app/flux_gradient.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/surface/meshes.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

constexpr std::uint32_t kCells = 10;
constexpr double kSlope = 0.3;

// A flat sheet over [0, 1]^2 under a flux of 1 + slope x, known to within `error`.
SurfaceFlux linear_flux(double error) {
    SurfaceFlux surface;
    surface.raw = test::grid_mesh(kCells, kCells, [](double u, double v) { return Vec3(u, v, 0.0); });
    surface.wedges = flux::make_wedges(surface.raw);
    flux::FluxResult species;
    for (const Vec3& p : surface.raw.vertices) species.wedge.flux.push_back(1.0 + kSlope * p.x());
    species.wedge.error.assign(species.wedge.flux.size(), error);
    surface.wedge_flux = {species.wedge.flux};
    surface.wedge_error = {species.wedge.error};
    surface.fluxes = {species};
    return surface;
}

}  // namespace

TEST_CASE("the gradient of a linear flux is its slope over the flux, and noise has none") {
    const SurfaceFlux exact = linear_flux(0.0);
    const std::vector<double> gradient = flux_gradient(exact);
    REQUIRE(gradient.size() == exact.raw.vertices.size());
    for (std::size_t v = 0; v < gradient.size(); ++v) {
        // Measured along the steepest edge at the vertex, at the edge's middle.
        const double x = exact.raw.vertices[v].x(), half = 0.5 / kCells;
        CHECK(gradient[v] <= kSlope / (1.0 + kSlope * std::max(0.0, x - half)) + 1e-12);
        CHECK(gradient[v] >= kSlope / (1.0 + kSlope * (x + half)) - 1e-12);
    }
    const double change = kSlope / kCells;
    for (const double g : flux_gradient(linear_flux(change / 3.0))) CHECK(g == 0.0);
}

TEST_CASE("edges resolve the flux of the step before, but never beyond the grid") {
    const SurfaceFlux surface = linear_flux(0.0);
    const CoverageField field =
        coverage_field(surface.raw, surface.wedges, {kFluxGradient}, {flux_gradient(surface)});
    constexpr double kChange = 0.1;
    const std::vector<double> lengths = resolving_lengths(field, surface.raw, kChange, 0.05);
    for (std::size_t v = 0; v < lengths.size(); ++v) {
        const double flux = surface.wedge_flux[0][v];
        CHECK(lengths[v] == Approx(kChange * flux / kSlope).epsilon(0.5 * kSlope / kCells));
    }
    for (const double length : resolving_lengths(field, surface.raw, kChange, 0.7)) CHECK(length == 0.7);
    for (const double length : resolving_lengths({}, surface.raw, kChange, 0.05)) CHECK(std::isinf(length));
}
