#include "flux/tracer/smoothing.hpp"

#include <tbb/parallel_for.h>

#include <cmath>

namespace sidewall::flux {
namespace {

// Arrivals on some triangles, and their area.
struct Arrivals {
    double arrivals = 0.0, area = 0.0;
    void add(const Arrivals& other) {
        arrivals += other.arrivals;
        area += other.area;
    }
    double mean() const { return area > 0.0 ? arrivals / area : 0.0; }
};

// Arrivals around every vertex: on its own triangles, and where those are smaller than `enough`, on rings
// around them.
std::vector<Arrivals> arrivals_around(const TriangleMesh& mesh, const std::vector<Arrivals>& triangle,
                                      double enough) {
    std::vector<Arrivals> around(mesh.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) around[v].add(triangle[t]);
    // Marching cubes' clusters of tiny triangles are a ring or two wide; few rays make everything small.
    constexpr int kMostRings = 8;
    for (int ring = 0; ring < kMostRings; ++ring) {
        const std::vector<Arrivals> before = around;
        bool grown = false;
        for (const Triangle& t : mesh.triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t v = t[k];
                if (before[v].area >= enough) continue;
                around[v].add(before[t[(k + 1) % 3]]);
                around[v].add(before[t[(k + 2) % 3]]);
                grown = true;
            }
        if (!grown) break;
    }
    return around;
}

}  // namespace

std::vector<double> smoothed_flux(const TriangleMesh& mesh, const Wedges& wedges, const FluxField& wedge_flux,
                                  std::uint64_t arrivals, double resolution) {
    const std::vector<double>& flux = wedge_flux.flux;
    std::vector<Arrivals> triangle(mesh.triangles.size()), own(wedges.count());
    Arrivals total;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::uint32_t* corner = &wedges.corner[3 * t];
        const double area = triangle_area(mesh, t);
        triangle[t] = {area * (flux[corner[0]] + flux[corner[1]] + flux[corner[2]]) / 3.0, area};
        for (int k = 0; k < 3; ++k) own[corner[k]].add(triangle[t]);
        total.add(triangle[t]);
    }
    constexpr double kArrivals = 10.0;
    const double enough = arrivals > 0 ? kArrivals * total.area / static_cast<double>(arrivals) : 0.0;
    const std::vector<Arrivals> around = arrivals_around(mesh, triangle, enough);

    const double tau = resolution * total.mean();
    std::vector<double> smooth(flux);
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t v) {
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) {
            const double variance = wedge_flux.error[w] * wedge_flux.error[w];
            const double mean = own[w].area < enough ? around[v].mean() : own[w].mean();
            double share = variance + tau * tau > 0.0 ? variance / (variance + tau * tau) : 0.0;
            // A wedge that no ray has hit does not know its error. Missed by chance, or in shadow? Among lit
            // ones, chance is taken to be that many times likelier before the hits that did not come count.
            constexpr double kOdds = 100.0;
            if (flux[w] == 0.0) {
                const double hits = total.arrivals > 0.0 ? static_cast<double>(arrivals) * mean *
                                                               own[w].area / (3.0 * total.arrivals)
                                                         : 0.0;
                const double chance = kOdds * std::exp(-hits);
                share = chance / (1.0 + chance);
            }
            smooth[w] += share * (mean - flux[w]);
        }
    });
    return smooth;
}

}  // namespace sidewall::flux
