#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/bench/flux_error.hpp"

using namespace sidewall;
using namespace sidewall::bench;

namespace {

// A plane of n x n squares whose true flux is 1 + x / 2, known from two runs of standard deviation 0.01.
struct NoisyFlux {
    TriangleMesh mesh;
    FluxTruth truth;
    std::vector<double> exact;
    std::mt19937 random{7};

    explicit NoisyFlux(std::uint32_t n) {
        for (std::uint32_t j = 0; j <= n; ++j)
            for (std::uint32_t i = 0; i <= n; ++i) mesh.vertices.push_back(Vec3(i, j, 0.001 * j) / n);
        for (std::uint32_t j = 0; j < n; ++j)
            for (std::uint32_t i = 0; i < n; ++i) {
                const std::uint32_t a = j * (n + 1) + i, c = a + n + 1;
                mesh.triangles.push_back({a, a + 1, c + 1});
                mesh.triangles.push_back({a, c + 1, c});
            }
        for (const Vec3& p : mesh.vertices) exact.push_back(1.0 + 0.5 * p.x());
        truth.vertex_area.assign(mesh.vertices.size(), 1.0);
        truth.flux = noisy(0.0, 0.01);
    }

    FluxPair noisy(double bias, double noise) {
        std::normal_distribution<double> normal(0.0, noise);
        FluxPair pair;
        for (auto* values : {&pair.first, &pair.second})
            for (const double f : exact) values->push_back(f + bias + normal(random));
        pair.rays = 1000.0;
        pair.seconds = 2.0;
        return pair;
    }
    // Root mean square of the true flux.
    double scale() const {
        double sum = 0.0;
        for (const double f : exact) sum += f * f;
        return std::sqrt(sum / static_cast<double>(exact.size()));
    }
};

}  // namespace

TEST_CASE("a flux error is split into bias and noise without mixing them up") {
    NoisyFlux plane(100);
    // One run's standard deviation is 0.2; both together have 0.2 / sqrt(2).
    const FluxError error = flux_error(plane.noisy(0.05, 0.2), plane.truth, 0.08);
    // 10201 vertices: the mean product of two errors of 0.2 has a standard error of 0.04 / 101 = 4e-4. A
    // squared bias of 2.5e-3 is known to 8 % of the bias at one sigma, the variance to sqrt(2) / 101.
    CHECK(error.bias == Approx(0.05 / plane.scale()).epsilon(0.3));
    CHECK(error.noise == Approx(0.2 / std::sqrt(2.0) / plane.scale()).epsilon(0.05));
    // rays * noise^2 / (target^2 - bias^2), at 500 rays a second.
    const double noise = error.noise, bias = error.bias;
    CHECK(*error.rays_to_error == Approx(1000.0 * noise * noise / (0.08 * 0.08 - bias * bias)));
    CHECK(*error.seconds_to_error == Approx(*error.rays_to_error * 0.002));
}

TEST_CASE("a bias beyond the target cannot be traced away") {
    NoisyFlux plane(50);
    const FluxError error = flux_error(plane.noisy(0.2, 0.05), plane.truth, 0.02);
    CHECK_FALSE(error.rays_to_error.has_value());
}

TEST_CASE("smoothing over neighbours takes noise down and keeps a linear flux away from the rim") {
    NoisyFlux plane(40);
    const FluxPair exact = plane.noisy(0.0, 0.0);
    const std::size_t middle = 20 * 41 + 20;
    CHECK(smoothed(exact.first, plane.mesh, 1)[middle] == Approx(exact.first[middle]).epsilon(1e-12));
    FluxPair pair = plane.noisy(0.0, 0.2);
    const double before = flux_error(pair, plane.truth, 0.02).noise;
    for (auto* values : {&pair.first, &pair.second}) *values = smoothed(*values, plane.mesh, 4);
    CHECK(flux_error(pair, plane.truth, 0.02).noise < 0.5 * before);
}
