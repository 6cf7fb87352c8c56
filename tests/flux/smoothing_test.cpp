#include "flux/tracer/smoothing.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "flux/random.hpp"
#include "tests/flux/flux_meshes.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

constexpr std::uint64_t kArrivals = 1'000'000;  // so many that every triangle expects some

// Flux 1 with independent noise of standard deviation sigma.
FluxField noisy(const Wedges& wedges, double sigma) {
    FluxField field{std::vector<double>(wedges.count()), std::vector<double>(wedges.count(), sigma)};
    for (std::size_t w = 0; w < wedges.count(); ++w) {
        const Draws d = draw(random_key(9, 0, 0), w, 0);
        field.flux[w] = 1.0 + sigma * std::sqrt(12.0) * (d.uniform(0) - 0.5);
    }
    return field;
}

double deviation(const std::vector<double>& values, double mean) {
    double sum = 0.0;
    for (const double v : values) sum += (v - mean) * (v - mean);
    return std::sqrt(sum / static_cast<double>(values.size()));
}

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

TEST_CASE("the noise of few arrivals is taken down, the mean stays") {
    const auto mesh = height_field(20, 20, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const Wedges wedges = make_wedges(mesh);
    const FluxField field = noisy(wedges, 0.3);
    const auto smooth = smoothed_flux(mesh, wedges, field, 1000);  // 1.25 arrivals a triangle
    CHECK(deviation(smooth, 1.0) < 0.6 * deviation(field.flux, 1.0));
    const double before = std::accumulate(field.flux.begin(), field.flux.end(), 0.0);
    const double after = std::accumulate(smooth.begin(), smooth.end(), 0.0);
    CHECK(after == Approx(before).epsilon(0.01));
}

TEST_CASE("what ten arrivals or more have brought stays, and a constant flux stays whatever its error") {
    const auto mesh = height_field(10, 10, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const Wedges wedges = make_wedges(mesh);
    const FluxField sharp = noisy(wedges, 0.15);
    const auto kept = smoothed_flux(mesh, wedges, sharp, kArrivals);
    for (std::size_t w = 0; w < wedges.count(); ++w) CHECK(kept[w] == sharp.flux[w]);
    const FluxField constant{std::vector<double>(wedges.count(), 2.5),
                             std::vector<double>(wedges.count(), 1.0)};
    for (const std::uint64_t arrivals : {kArrivals, std::uint64_t{100}})
        for (const double f : smoothed_flux(mesh, wedges, constant, arrivals)) CHECK(f == Approx(2.5));
}

TEST_CASE("nothing is smeared across a crease") {
    const auto mesh = extrude(trench_profile(1.0, 0.5, {0.5}, {0.5}), 1.0, 4);
    const Wedges wedges = make_wedges(mesh);
    const auto normals = triangle_normals(mesh);
    // Flux 0.2 on walls and 1 on level parts, with a large standard error throughout.
    FluxField field{std::vector<double>(wedges.count()), std::vector<double>(wedges.count(), 0.5)};
    std::vector<bool> wall(wedges.count());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
        wall[wedges.corner[c]] = std::abs(normals[c / 3].x()) > 0.5;
        field.flux[wedges.corner[c]] = wall[wedges.corner[c]] ? 0.2 : 1.0;
    }
    const auto smooth = smoothed_flux(mesh, wedges, field, kArrivals);
    for (std::size_t w = 0; w < wedges.count(); ++w) CHECK(smooth[w] == Approx(wall[w] ? 0.2 : 1.0));
}

TEST_CASE("a wedge that no particle has hit takes its neighbours' value as far as that is chance") {
    const auto mesh = height_field(4, 4, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const Wedges wedges = make_wedges(mesh);
    FluxField field{std::vector<double>(wedges.count(), 1.0), std::vector<double>(wedges.count(), 0.0)};
    field.flux[12] = 0.0;  // in the middle of 32 triangles, on six of them
    // Means of the linear flux over the vertex's triangles and over the surface. The former would bring
    // `hits` to the wedge, which has a third of them.
    const double mean = 2.0 / 3.0, all = (32.0 - 2.0) / 32.0;
    for (const std::uint64_t arrivals : {60u, 100u, 1'000'000u}) {
        const double hits = static_cast<double>(arrivals) * mean / all * 6.0 / 32.0 / 3.0;
        const auto smooth = smoothed_flux(mesh, wedges, field, arrivals);
        const double chance = 100.0 * std::exp(-hits);
        CHECK(smooth[12] == Approx(chance / (1.0 + chance) * mean).margin(1e-12));
        for (std::size_t w = 0; w < wedges.count(); ++w)
            if (w != 12) CHECK(smooth[w] == 1.0);
    }
}

TEST_CASE("where few arrive a flux moves to the mean of its triangles by sigma^2 / (sigma^2 + tau^2)") {
    const TriangleMesh mesh = plane(6);
    const flux::Wedges wedges = flux::make_wedges(mesh);
    const std::size_t middle = 3 * 7 + 3;  // one wedge a vertex
    flux::FluxField flux = field(wedges.count(), 1.0, 0.0);
    // In the penumbra around the middle a hundredth arrives: of 4000 hits its triangles get nine, those
    // around an open vertex 440.
    for (std::size_t j = 2; j <= 4; ++j)
        for (std::size_t i = 2; i <= 4; ++i) flux.flux[j * 7 + i] = 0.01;
    flux.flux[middle] = 0.04;
    flux.error[middle] = 0.015;
    // The six equal triangles around the middle have a mean of (0.04 + 0.01 + 0.01) / 3. On the 36 squares
    // eight vertices lack 0.99 and one 0.96.
    const double mean = 0.02, tau = 0.02 * (36.0 - 8.0 * 0.99 - 0.96) / 36.0, variance = 0.015 * 0.015;
    const auto smooth = flux::smoothed_flux(mesh, wedges, flux, 4000);
    CHECK(smooth[middle] == Approx(0.04 + variance / (variance + tau * tau) * (mean - 0.04)).epsilon(1e-12));
    CHECK(flux::smoothed_flux(mesh, wedges, flux, 1'000'000)[middle] == 0.04);
}

TEST_CASE(
    "triangles too small to be hit take their surroundings' flux, and large ones that are not stay dark") {
    // The ring around the middle vertex is shrunk to a thousandth of a cell, and nothing hits it.
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

    // The same fluxes on full-sized triangles, each of which expects far more than ten hits.
    const TriangleMesh coarse = plane(6);
    const flux::Wedges fans = flux::make_wedges(coarse);
    flux::FluxField dark = field(fans.count(), 1.0, 0.0);
    for (const std::size_t w : tiny) dark.flux[w] = 0.0;
    CHECK(flux::smoothed_flux(coarse, fans, dark, 10'000)[3 * 7 + 3] == 0.0);
}
