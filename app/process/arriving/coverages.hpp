#pragma once
#include <tbb/parallel_for.h>

#include <cstdint>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"

// Coverages of the traced surface's wedges, and how species stick and desorb with them.
namespace sidewall::app {

/// Materials and positions of the wedges, which stay constant while coverages settle.
struct WedgePoints {
    std::vector<std::int32_t> materials;
    std::vector<Vec3> positions;  ///< empty unless Model::depends_on_position
    double time = 0.0;            ///< since the step began
};

WedgePoints wedge_points(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving);

/// Calls use(wedge, point) for every wedge in parallel, with fluxes (none before the first trace) and
/// coverages.
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

/// Whether coverages are in steady state with the fluxes: neither transient nor pulsed.
bool are_steady(const Coverages& coverages);

/// How species leave the surface, by species and wedge. Empty: the species' own sticking; no emission.
struct Leaving {
    std::vector<double> sticking, emission;
};

/// Sticking and emission that follow from the coverages of \p arriving. In steady state, desorption d acts as
/// a lower sticking s - d/Gamma, and only an excess is emitted. So a species that adsorbs and desorbs many
/// times settles within one trace.
/// \param before  fluxes Gamma by tally and wedge that balance steady coverages; empty: coverages are not
///                steady, or no flux is known.
Leaving leaving_of(const Model& model, const SurfaceFlux& arriving, const WedgePoints& points,
                   const std::vector<std::vector<double>>& before);

/// Sticking with the coverages of \p arriving, by species and wedge; empty if coverages do not affect it.
std::vector<double> sticking_left(const Model& model, const TracedSurface& surface,
                                  const SurfaceFlux& arriving);

/// Coverages after reacting for \p time with the present fluxes, one list a name by wedge.
/// \param flux_before  fluxes \p time ago, from which fluxes at time/2 are extrapolated; empty: constant.
std::vector<std::vector<double>> reacted(const Model& model, double time, const SurfaceFlux& arriving,
                                         const WedgePoints& points,
                                         const std::vector<std::vector<double>>& flux_before = {});

/// Coverages at the end of a time step \p dt, one list a name by wedge. Transient ones react and diffuse
/// along the surface for that time; others stay as the trace left them.
/// \pre the surface was traced.
std::vector<std::vector<double>> coverages_after(const Model& model, const TracedSurface& surface, double dt);

}  // namespace sidewall::app
