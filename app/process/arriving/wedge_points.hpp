#pragma once
#include <tbb/parallel_for.h>

#include <cstdint>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"

// The points at which coverages are known: the wedges of a traced surface.
namespace sidewall::app {

/// What stays the same while coverages settle.
struct WedgePoints {
    std::vector<std::int32_t> materials;
    std::vector<Vec3> positions;  ///< empty unless the model asks
    double time = 0.0;            ///< since the step began
};

WedgePoints wedge_points(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving);

/// Calls use(wedge, point) for every wedge in parallel, with its fluxes (none before the first trace) and coverages.
template <class Use>
void each_wedge(const SurfaceFlux& arriving, const WedgePoints& points, Use&& use) {
    const std::size_t tallies = arriving.flux.size(), coverages = arriving.coverage.size();
    const auto range_of = tbb::blocked_range<std::size_t>(0, points.materials.size(), 512);
    tbb::parallel_for(range_of, [&](const auto& range) {
        std::vector<double> flux(tallies), theta(coverages);
        for (std::size_t w = range.begin(); w != range.end(); ++w) {
            for (std::size_t k = 0; k < tallies; ++k) flux[k] = arriving.flux[k][w];
            for (std::size_t k = 0; k < coverages; ++k) theta[k] = arriving.coverage[k][w];
            const Vec3 position = points.positions.empty() ? Vec3(Vec3::Zero()) : points.positions[w];
            use(w,
                SurfacePoint{points.materials[w], flux, Vec3::UnitZ(), true, theta, position, points.time});
        }
    });
}

}  // namespace sidewall::app
