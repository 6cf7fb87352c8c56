#pragma once
#include <tbb/parallel_for.h>

#include <cstdint>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"

// Coverages of the traced surface's wedges, and how they let species stick and desorb.
namespace sidewall::app {

/// The points at which coverages are known: what stays the same while they settle.
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

/// Whether coverages are in steady state with the fluxes.
bool are_steady(const Coverages& coverages);

/// How species leave the surface, by species and wedge; each list empty where the species say all.
struct Leaving {
    std::vector<double> sticking, emission;
};

/// Sticking and emission that the coverages of \p arriving leave. In steady state desorption d acts as a lower
/// effective sticking, s - d/Gamma; only the excess is emitted. So what adsorbs and desorbs many times settles
/// within one trace, not by repeated ones.
/// \param before  fluxes Gamma by tally and wedge that keep steady coverages up; empty: they are not steady, or
///                no flux is known.
Leaving leaving_of(const Model& model, const SurfaceFlux& arriving, const WedgePoints& points,
                   const std::vector<std::vector<double>>& before);

/// Sticking that the coverages of \p arriving leave, by species and wedge; empty where they decide nothing.
std::vector<double> sticking_left(const Model& model, const TracedSurface& surface,
                                  const SurfaceFlux& arriving);

/// Coverages after \p time of the fluxes at hand, one list a name by wedge.
/// \param flux_before  fluxes that time earlier: those at hand go on as they changed since, up to its middle; empty: they stay.
std::vector<std::vector<double>> reacted(const Model& model, double time, const SurfaceFlux& arriving,
                                         const WedgePoints& points,
                                         const std::vector<std::vector<double>>& flux_before = {});

/// Coverages at the end of a time step \p dt, one list a name by wedge: transient ones react and spread along
/// the surface for that long; others are what tracing has found.
/// \pre the surface was traced.
std::vector<std::vector<double>> coverages_after(const Model& model, const TracedSurface& surface, double dt);

}  // namespace sidewall::app
