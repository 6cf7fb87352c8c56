#include "flux/smoothing.hpp"

#include <tbb/parallel_for.h>

#include <cmath>

namespace sidewall::flux {
namespace {

// What arrives on some triangles, and their area.
struct Catch {
    double arrivals = 0.0, area = 0.0;
    void add(const Catch& other) {
        arrivals += other.arrivals;
        area += other.area;
    }
    double mean() const { return area > 0.0 ? arrivals / area : 0.0; }
};

// Around every place of a triangle's corner: what it has itself, and where that is smaller than `enough`,
// rings around it.
template <class PlaceOf>
std::vector<Catch> catch_around(std::vector<Catch> around, std::size_t triangles, double enough,
                                const PlaceOf& place_of) {
    // Marching cubes' clusters of tiny triangles are a ring or two wide; few rays make everything small.
    constexpr int kMostRings = 8;
    for (int ring = 0; ring < kMostRings; ++ring) {
        const std::vector<Catch> before = around;
        bool grown = false;
        for (std::size_t t = 0; t < triangles; ++t)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t place = place_of(t, k);
                if (before[place].area >= enough) continue;
                around[place].add(before[place_of(t, (k + 1) % 3)]);
                around[place].add(before[place_of(t, (k + 2) % 3)]);
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
    std::vector<Catch> own(wedges.count()), at_vertex(mesh.vertices.size());
    Catch total;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::uint32_t* corner = &wedges.corner[3 * t];
        const double area = triangle_area(mesh, t);
        const Catch caught{area * (flux[corner[0]] + flux[corner[1]] + flux[corner[2]]) / 3.0, area};
        for (std::size_t k = 0; k < 3; ++k) {
            own[corner[k]].add(caught);
            at_vertex[mesh.triangles[t][k]].add(caught);
        }
        total.add(caught);
    }
    constexpr double kArrivals = 10.0;
    const double enough = arrivals > 0 ? kArrivals * total.area / static_cast<double>(arrivals) : 0.0;
    // Within creases; a patch too small for that, such as a sliver between creases, looks across them.
    const std::vector<Catch> patch =
        catch_around(own, mesh.triangles.size(), enough,
                     [&](std::size_t t, std::size_t k) { return wedges.corner[3 * t + k]; });
    const std::vector<Catch> around =
        catch_around(std::move(at_vertex), mesh.triangles.size(), enough,
                     [&](std::size_t t, std::size_t k) { return mesh.triangles[t][k]; });

    const double tau = resolution * total.mean();
    std::vector<double> smooth(flux);
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t v) {
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) {
            const double mean = patch[w].area < enough ? around[v].mean() : patch[w].mean();
            const double variance = wedge_flux.error[w] * wedge_flux.error[w];
            double share = variance + tau * tau > 0.0 ? variance / (variance + tau * tau) : 0.0;
            // A wedge that no ray has met does not know its error. How likely is that, were its flux the
            // mean?
            if (flux[w] == 0.0) {
                const double hits = total.arrivals > 0.0 ? static_cast<double>(arrivals) * mean *
                                                               own[w].area / (3.0 * total.arrivals)
                                                         : 0.0;
                share = std::exp(-hits);
            }
            smooth[w] += share * (mean - flux[w]);
        }
    });
    return smooth;
}

}  // namespace sidewall::flux
