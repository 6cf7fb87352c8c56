#include "app/process/coverages.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "app/process/species_flux.hpp"

namespace sidewall::app {
namespace {

// Material of every wedge.
std::vector<std::int32_t> wedge_materials(const SurfaceFlux& arriving) {
    std::vector<std::int32_t> materials(arriving.wedges.count(), 0);
    for (std::size_t c = 0; c < arriving.wedges.corner.size(); ++c)
        materials[arriving.wedges.corner[c]] = arriving.materials[c / 3];
    return materials;
}

// Calls use(wedge, point) for every wedge in parallel, with its fluxes (none before the first trace) and
// coverages.
template <class Use>
void each_wedge(const SurfaceFlux& arriving, const std::vector<std::int32_t>& materials, Use&& use) {
    const std::size_t tallies = arriving.flux.size(), coverages = arriving.coverage.size();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, materials.size(), 512), [&](const auto& range) {
        std::vector<double> flux(tallies), theta(coverages);
        for (std::size_t w = range.begin(); w != range.end(); ++w) {
            for (std::size_t k = 0; k < tallies; ++k) flux[k] = arriving.flux[k][w];
            for (std::size_t k = 0; k < coverages; ++k) theta[k] = arriving.coverage[k][w];
            use(w, SurfacePoint{materials[w], flux, Vec3::UnitZ(), true, theta});
        }
    });
}

// Sticking that the coverages leave, by species and wedge; empty where they decide nothing.
std::vector<double> sticking_of(const Model& model, const SurfaceFlux& arriving,
                                const std::vector<std::int32_t>& materials) {
    std::vector<double> sticking;
    if (!model.sticking) return sticking;
    sticking.resize(model.species.size() * materials.size());
    each_wedge(arriving, materials, [&](std::size_t w, const SurfacePoint& point) {
        for (std::size_t k = 0; k < model.species.size(); ++k)
            sticking[k * materials.size() + w] = model.sticking(k, point);
    });
    return sticking;
}

// Coverages after `time` of the fluxes at hand.
std::vector<std::vector<double>> reacted(const Model& model, double time, const SurfaceFlux& arriving,
                                         const std::vector<std::int32_t>& materials) {
    std::vector<std::vector<double>> next = arriving.coverage;
    each_wedge(arriving, materials, [&](std::size_t w, const SurfacePoint& point) {
        std::vector<double> theta(point.coverage.begin(), point.coverage.end());
        model.coverages.react(point, time, theta);
        for (std::size_t k = 0; k < theta.size(); ++k) next[k][w] = theta[k];
    });
    return next;
}

// The largest mean change of a coverage over the surface.
double mean_change(const flux::Wedges& wedges, const std::vector<std::vector<double>>& before,
                   const std::vector<std::vector<double>>& after) {
    double most = 0.0;
    for (std::size_t k = 0; k < after.size(); ++k) {
        double change = 0.0, area = 0.0;
        for (std::size_t w = 0; w < wedges.count(); ++w) {
            change += wedges.area[w] * std::abs(after[k][w] - before[k][w]);
            area += wedges.area[w];
        }
        most = std::max(most, area > 0.0 ? change / area : 0.0);
    }
    return most;
}

}  // namespace

SurfaceFlux settled_fluxes(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                           SurfaceFlux arriving, const SurfaceField& carried, const TraceRequest& request) {
    const std::vector<std::int32_t> materials = wedge_materials(arriving);
    const Coverages& coverages = model.coverages;
    const bool pulsed = coverages.pulse > 0.0, any = !coverages.names.empty();
    if (pulsed)
        arriving.coverage.assign(coverages.names.size(), std::vector<double>(materials.size(), 0.0));
    else if (any)
        arriving.coverage = carry(carried, coverages.names, surface.traced(), arriving.wedges);
    const double time = pulsed ? coverages.pulse / coverages.parts : 0.0;
    const int most = !any ? 1 : pulsed ? coverages.parts : request.settle ? coverages.most_iterations : 1;
    for (int traces = 1;; ++traces) {
        trace_species(recipe, model, surface, sticking_of(model, arriving, materials), request, arriving);
        arriving.trace->traces = traces;
        if (!any) return arriving;
        std::vector<std::vector<double>> next = reacted(model, time, arriving, materials);
        arriving.trace->coverage_change = mean_change(arriving.wedges, arriving.coverage, next);
        arriving.coverage = std::move(next);
        const bool settled = !pulsed && !(arriving.trace->coverage_change > coverages.tolerance);
        if (settled || traces >= most) return arriving;
    }
}

}  // namespace sidewall::app
