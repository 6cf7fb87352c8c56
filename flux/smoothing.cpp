#include "flux/smoothing.hpp"

#include <tbb/parallel_for.h>

namespace sidewall::flux {

std::vector<double> smoothed_flux(const TriangleMesh& mesh, const Wedges& wedges, const FluxField& wedge_flux,
                                  double resolution) {
    const std::vector<double>& flux = wedge_flux.flux;
    std::vector<double> sum(wedges.count(), 0.0), area(wedges.count(), 0.0);
    double total = 0.0, total_area = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::uint32_t* corner = &wedges.corner[3 * t];
        const double a = triangle_area(mesh, t);
        const double arrivals = a * (flux[corner[0]] + flux[corner[1]] + flux[corner[2]]) / 3.0;
        for (int k = 0; k < 3; ++k) {
            sum[corner[k]] += arrivals;
            area[corner[k]] += a;
        }
        total += arrivals;
        total_area += a;
    }
    const double tau = total_area > 0.0 ? resolution * total / total_area : 0.0;
    std::vector<double> smooth(flux);
    tbb::parallel_for(std::size_t{0}, smooth.size(), [&](std::size_t w) {
        const double variance = wedge_flux.error[w] * wedge_flux.error[w];
        // A wedge that no ray has met knows nothing, not even its error.
        const double share = flux[w] == 0.0               ? 1.0
                             : variance + tau * tau > 0.0 ? variance / (variance + tau * tau)
                                                          : 0.0;
        if (area[w] > 0.0) smooth[w] += share * (sum[w] / area[w] - flux[w]);
    });
    return smooth;
}

}  // namespace sidewall::flux
