#include "app/process/arriving/flux_gradient.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidewall::app {

std::vector<double> flux_gradient(const TriangleMesh& mesh, const SurfaceFlux& arriving) {
    // Standard errors of a difference: noise alone exceeds three on one edge in 370, so that it hardly
    // refines.
    constexpr double kNoise = 3.0;
    const flux::Wedges& wedges = arriving.wedges;
    std::vector<double> gradient(wedges.count(), 0.0);
    for (std::size_t tally = 0; tally < arriving.flux.size(); ++tally) {
        const std::vector<double>& flux = arriving.flux[tally];
        const std::vector<double>& error = arriving.trace->error[tally];
        for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
            const std::size_t next = c % 3 == 2 ? c - 2 : c + 1;
            const std::uint32_t v = wedges.corner[c], w = wedges.corner[next];
            const double change = std::abs(flux[v] - flux[w]) - kNoise * std::hypot(error[v], error[w]);
            const double length = (mesh.vertices[mesh.triangles[c / 3][c % 3]] -
                                   mesh.vertices[mesh.triangles[next / 3][next % 3]])
                                      .norm();
            if (!(change > 0.0) || !(length > 0.0)) continue;
            const double steep = change / (0.5 * (std::abs(flux[v]) + std::abs(flux[w])) * length);
            gradient[v] = std::max(gradient[v], steep);
            gradient[w] = std::max(gradient[w], steep);
        }
    }
    return gradient;
}

std::vector<double> resolving_lengths(const SurfaceField& carried, const TriangleMesh& mesh, double change,
                                      double spacing) {
    std::vector<double> lengths = carry(carried, {kFluxGradient}, mesh.vertices).front();
    for (double& length : lengths)
        length = length > 0.0 ? std::max(spacing, change / length) : std::numeric_limits<double>::infinity();
    return lengths;
}

}  // namespace sidewall::app
