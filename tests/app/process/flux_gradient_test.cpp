#include <catch2/catch.hpp>
#include <cmath>

#include "app/process/arriving/surface_field.hpp"
#include "app/process/arriving/traced_mesh.hpp"
#include "tests/surface/surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

constexpr std::uint32_t kCells = 10;
constexpr double kSlope = 0.3;

TriangleMesh sheet() {
    return test::grid_mesh(kCells, kCells, [](double u, double v) { return Vec3(u, v, 0.0); });
}

// On a flat sheet over [0, 1]^2, a flux of 1 + slope x, known to within `error`.
SurfaceFlux linear_flux(const TriangleMesh& mesh, double error) {
    SurfaceFlux arriving;
    arriving.wedges = flux::make_wedges(mesh);
    std::vector<double>& flux = arriving.flux.emplace_back();
    for (const Vec3& p : mesh.vertices) flux.push_back(1.0 + kSlope * p.x());
    arriving.trace.emplace().error = {std::vector<double>(flux.size(), error)};
    return arriving;
}

}  // namespace

TEST_CASE("the gradient of a linear flux is its slope over the flux, and noise has none") {
    const TriangleMesh mesh = sheet();
    const std::vector<double> gradient = flux_gradient(mesh, linear_flux(mesh, 0.0));
    REQUIRE(gradient.size() == mesh.vertices.size());
    for (std::size_t v = 0; v < gradient.size(); ++v) {
        // The gradient is taken along the steepest edge at the vertex, over the flux at this edge's middle.
        const double x = mesh.vertices[v].x(), half = 0.5 / kCells;
        CHECK(gradient[v] <= kSlope / (1.0 + kSlope * std::max(0.0, x - half)) + 1e-12);
        CHECK(gradient[v] >= kSlope / (1.0 + kSlope * (x + half)) - 1e-12);
    }
    const double change = kSlope / kCells;
    for (const double g : flux_gradient(mesh, linear_flux(mesh, change / 3.0))) CHECK(g == 0.0);
}

TEST_CASE("edges resolve the flux of the step before, but never beyond the grid") {
    const TriangleMesh mesh = sheet();
    const SurfaceFlux arriving = linear_flux(mesh, 0.0);
    const SurfaceField field =
        surface_field(mesh, arriving.wedges, {kFluxGradient}, {flux_gradient(mesh, arriving)});
    constexpr double kChange = 0.1;
    const std::vector<double> lengths = resolving_lengths(field, mesh, {}, kChange, 0.05);
    for (std::size_t v = 0; v < lengths.size(); ++v) {
        const double flux = arriving.flux[0][v];
        CHECK(lengths[v] == Approx(kChange * flux / kSlope).epsilon(0.5 * kSlope / kCells));
    }
    for (const double length : resolving_lengths(field, mesh, {}, kChange, 0.7)) CHECK(length == 0.7);
    for (const double length : resolving_lengths({}, mesh, {}, kChange, 0.05)) CHECK(std::isinf(length));
}
