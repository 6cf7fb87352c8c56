#include "flux/smoothing.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "flux/random.hpp"
#include "tests/flux/meshes.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

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

}  // namespace

TEST_CASE("noise is taken down, the mean stays") {
    const auto mesh = height_field(20, 20, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const Wedges wedges = make_wedges(mesh);
    const FluxField field = noisy(wedges, 0.3);
    const auto smooth = smoothed_flux(mesh, wedges, field);
    CHECK(deviation(smooth, 1.0) < 0.6 * deviation(field.flux, 1.0));
    const double before = std::accumulate(field.flux.begin(), field.flux.end(), 0.0);
    const double after = std::accumulate(smooth.begin(), smooth.end(), 0.0);
    CHECK(after == Approx(before).epsilon(0.01));
}

TEST_CASE("a tally sharper than the resolution stays; a constant flux stays whatever its error") {
    const auto mesh = height_field(10, 10, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const Wedges wedges = make_wedges(mesh);
    const FluxField sharp = noisy(wedges, 1e-4);
    const auto kept = smoothed_flux(mesh, wedges, sharp);
    for (std::size_t w = 0; w < wedges.count(); ++w) CHECK(std::abs(kept[w] - sharp.flux[w]) < 1e-7);
    const FluxField constant{std::vector<double>(wedges.count(), 2.5),
                             std::vector<double>(wedges.count(), 1.0)};
    for (const double f : smoothed_flux(mesh, wedges, constant)) CHECK(f == Approx(2.5));
}

TEST_CASE("nothing is smeared across a crease") {
    const auto mesh = extrude(trench_profile(1.0, 0.5, {0.5}, {0.5}), 1.0, 4);
    const Wedges wedges = make_wedges(mesh);
    const auto normals = triangle_normals(mesh);
    // Walls 0.2, level parts 1, noisy throughout.
    FluxField field{std::vector<double>(wedges.count()), std::vector<double>(wedges.count(), 0.5)};
    std::vector<bool> wall(wedges.count());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
        wall[wedges.corner[c]] = std::abs(normals[c / 3].x()) > 0.5;
        field.flux[wedges.corner[c]] = wall[wedges.corner[c]] ? 0.2 : 1.0;
    }
    const auto smooth = smoothed_flux(mesh, wedges, field);
    for (std::size_t w = 0; w < wedges.count(); ++w) CHECK(smooth[w] == Approx(wall[w] ? 0.2 : 1.0));
}

TEST_CASE("a wedge that no particle has met takes its neighbours' value") {
    const auto mesh = height_field(4, 4, 1.0, 1.0, [](auto, auto) { return 0.0; });
    const Wedges wedges = make_wedges(mesh);
    FluxField field{std::vector<double>(wedges.count(), 1.0), std::vector<double>(wedges.count(), 0.0)};
    field.flux[12] = 0.0;  // in the middle
    const auto smooth = smoothed_flux(mesh, wedges, field);
    CHECK(smooth[12] == Approx(2.0 / 3.0));  // the mean of the linear flux over its own triangles
    for (std::size_t w = 0; w < wedges.count(); ++w)
        if (w != 12) CHECK(smooth[w] == 1.0);
}
