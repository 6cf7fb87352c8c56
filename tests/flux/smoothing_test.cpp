#include "flux/smoothing.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/flux/meshes.hpp"

using namespace sidewall;

namespace {

/// n x n squares of side 1 on the plane, two triangles each, vertex j * (n + 1) + i at (i, j).
TriangleMesh plane(std::uint32_t n) {
    TriangleMesh mesh;
    for (std::uint32_t j = 0; j <= n; ++j)
        for (std::uint32_t i = 0; i <= n; ++i) mesh.vertices.push_back(Vec3(i, j, 0));
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    return mesh;
}

flux::FluxField field(std::size_t count, double value, double error) {
    return {std::vector<double>(count, value), std::vector<double>(count, error)};
}

}  // namespace

TEST_CASE("a flux known better than the resolution stays as it is") {
    const TriangleMesh mesh = plane(6);
    const flux::Wedges wedges = flux::make_wedges(mesh);
    flux::FluxField flux = field(wedges.count(), 1.0, 0.0);
    for (std::size_t w = 0; w < flux.flux.size(); ++w) flux.flux[w] = 0.5 + 0.1 * static_cast<double>(w % 7);
    CHECK(flux::smoothed_flux(mesh, wedges, flux, 1'000'000) == flux.flux);
}

TEST_CASE("a noisy flux moves to the mean of its triangles by the share sigma^2 / (sigma^2 + tau^2)") {
    const TriangleMesh mesh = plane(6);
    const flux::Wedges wedges = flux::make_wedges(mesh);
    flux::FluxField flux = field(wedges.count(), 1.0, 0.0);
    const std::size_t middle = 3 * 7 + 3;  // one wedge a vertex
    flux.flux[middle] = 4.0;
    flux.error[middle] = 0.05;
    // Six triangles of equal area around it, each with two corners of flux 1: their mean is (4 + 1 + 1) / 3.
    // Over the 36 squares the mean flux is 1 + 3 * (6 / 3 * 0.5) / 36.
    const double tau = 0.02 * (1.0 + 3.0 / 36.0), variance = 0.05 * 0.05;
    const double expected = 4.0 + variance / (variance + tau * tau) * (2.0 - 4.0);
    const auto smooth = flux::smoothed_flux(mesh, wedges, flux, 1'000'000);
    CHECK(smooth[middle] == Approx(expected).epsilon(1e-12));
    CHECK(smooth[0] == 1.0);
}

TEST_CASE("triangles too small to be hit take their surroundings' flux; large ones that are not stay dark") {
    // The middle vertex's ring is drawn together to a thousandth of a cell, and nothing hits it.
    TriangleMesh mesh = plane(6);
    const Vec3 centre = mesh.vertices[3 * 7 + 3];
    std::vector<std::size_t> tiny;
    for (std::size_t j = 2; j <= 4; ++j)
        for (std::size_t i = 2; i <= 4; ++i) {
            Vec3& p = mesh.vertices[j * 7 + i];
            p = centre + 1e-3 * (p - centre);
            tiny.push_back(j * 7 + i);
        }
    const flux::Wedges wedges = flux::make_wedges(mesh);
    flux::FluxField flux = field(wedges.count(), 1.0, 0.0);
    for (const std::size_t w : tiny) flux.flux[w] = 0.0;
    const auto smooth = flux::smoothed_flux(mesh, wedges, flux, 10'000);
    CHECK(smooth[3 * 7 + 3] > 0.4);

    // The same without hits on a plane of full-sized triangles, far more than ten hits each expected.
    const TriangleMesh coarse = plane(6);
    const flux::Wedges fans = flux::make_wedges(coarse);
    flux::FluxField dark = field(fans.count(), 1.0, 0.0);
    for (const std::size_t w : tiny) dark.flux[w] = 0.0;
    CHECK(flux::smoothed_flux(coarse, fans, dark, 10'000)[3 * 7 + 3] == 0.0);
}
