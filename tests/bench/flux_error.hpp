#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "tests/bench/five_ways/five_ways.hpp"

// The error of a flux against a reference run, each known from two independent calculations.
namespace sidewall::bench {

/// One flux calculation repeated with another seed, as values at the vertices of the surface under study.
struct FluxPair {
    std::vector<double> first, second;
    double seconds = 0.0;  ///< CPU seconds of both
    double rays = 0.0;     ///< source rays of both
};

/// The surface that fluxes are compared on, and the flux that counts as true there.
struct FluxTruth {
    std::vector<double> vertex_area;
    FluxPair flux;
};

/// Traces a neutral twice on \p mesh, with half of the rays each.
inline FluxPair trace_pair(const TriangleMesh& mesh, const TriangleMesh& surface, const flux::LateralBox& box,
                           double rays, double sticking, std::uint64_t seed) {
    const MeshFlux flux(mesh, surface, box);
    FluxPair pair{.rays = rays};
    for (auto* values : {&pair.first, &pair.second})
        *values = flux.at_vertices(flux.traced(0.5 * rays, sticking, seed++, pair.seconds));
    return pair;
}

/// Traces \p surface itself.
inline FluxTruth make_truth(const TriangleMesh& surface, const flux::LateralBox& box, double rays,
                            double sticking) {
    constexpr std::uint64_t kSeed = 1'000'003;  // unlike the seeds of the compared runs
    FluxTruth truth{std::vector<double>(surface.vertices.size(), 0.0),
                    trace_pair(surface, surface, box, rays, sticking, kSeed)};
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t])
            truth.vertex_area[v] += triangle_area(surface, t) / 3.0;
    return truth;
}

/// Relative errors, L2 over the surface.
struct FluxError {
    double bias = 0.0, noise = 0.0;  ///< noise: standard deviation, at the pair's rays together
    std::optional<double> rays_to_error, seconds_to_error;  ///< none if the bias alone exceeds the target
};

/// The error of \p pair, split into bias and noise. Both estimators are unbiased: the mean product of two
/// independent errors is the squared bias, half the mean squared difference of two runs the variance.
inline FluxError flux_error(const FluxPair& pair, const FluxTruth& truth, double target) {
    double square = 0.0, bias = 0.0, spread = 0.0;
    for (std::size_t v = 0; v < truth.vertex_area.size(); ++v) {
        const double a = truth.vertex_area[v], first = pair.first[v], second = pair.second[v];
        square += a * truth.flux.first[v] * truth.flux.second[v];
        bias += a * (first - truth.flux.first[v]) * (second - truth.flux.second[v]);
        spread += a * 0.5 * (first - second) * (first - second);
    }
    // One run has half of the rays; both together have half of its variance.
    FluxError error{.bias = std::sqrt(std::max(0.0, bias) / square),
                    .noise = std::sqrt(0.5 * spread / square)};
    const double left = target * target - error.bias * error.bias;
    if (left > 0.0) {
        error.rays_to_error = pair.rays * error.noise * error.noise / left;
        error.seconds_to_error = *error.rays_to_error * pair.seconds / pair.rays;
    }
    return error;
}

}  // namespace sidewall::bench
