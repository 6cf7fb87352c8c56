#include "app/process/coverages.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/process/flux_methods.hpp"
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

// Where each wedge is; empty unless the model asks.
std::vector<Vec3> wedge_positions(const Model& model, const TriangleMesh& mesh, const flux::Wedges& wedges) {
    std::vector<Vec3> positions(model.depends_on_position ? wedges.count() : 0);
    for (std::size_t c = 0; c < wedges.corner.size() && !positions.empty(); ++c)
        positions[wedges.corner[c]] = mesh.vertices[mesh.triangles[c / 3][c % 3]];
    return positions;
}

// What stays the same while coverages settle.
struct WedgePoints {
    std::vector<std::int32_t> materials;
    std::vector<Vec3> positions;
    double time = 0.0;
};

WedgePoints wedge_points(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving) {
    return {wedge_materials(arriving), wedge_positions(model, surface.traced(), arriving.wedges),
            surface.time};
}

// Calls use(wedge, point) for every wedge in parallel, with its fluxes (none before the first trace) and
// coverages.
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

// Sticking that the coverages leave, by species and wedge; empty where they decide nothing.
std::vector<double> sticking_of(const Model& model, const SurfaceFlux& arriving, const WedgePoints& points) {
    std::vector<double> sticking;
    if (!model.sticking) return sticking;
    const std::size_t count = points.materials.size();
    sticking.resize(model.species.size() * count);
    each_wedge(arriving, points, [&](std::size_t w, const SurfacePoint& point) {
        for (std::size_t k = 0; k < model.species.size(); ++k)
            sticking[k * count + w] = model.sticking(k, point);
    });
    return sticking;
}

// Coverages after `time` of the fluxes at hand.
std::vector<std::vector<double>> reacted(const Model& model, double time, const SurfaceFlux& arriving,
                                         const WedgePoints& points) {
    std::vector<std::vector<double>> next = arriving.coverage;
    each_wedge(arriving, points, [&](std::size_t w, const SurfacePoint& point) {
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
    const WedgePoints points = wedge_points(model, surface, arriving);
    const Coverages& coverages = model.coverages;
    const bool pulsed = coverages.pulse > 0.0, any = !coverages.names.empty();
    if (pulsed)
        arriving.coverage.assign(coverages.names.size(), std::vector<double>(points.materials.size(), 0.0));
    else if (any)
        arriving.coverage = carry(carried, coverages.names, surface.traced(), arriving.wedges);
    const double time = pulsed ? coverages.pulse / coverages.parts : 0.0;
    SharedTraces shared{request.methods, {}, {}};
    // Anew when the coverages have settled.
    bool choose = recipe.flux.method == "auto" && model.sticking && request.settle && !pulsed &&
                  !are_of(model, request.methods);
    int most = !any ? 1 : pulsed ? coverages.parts : request.settle ? coverages.most_iterations : 1;
    for (int traces = 1;; ++traces) {
        const std::vector<double> sticking = sticking_of(model, arriving, points);
        if (!are_of(model, shared.methods))
            shared.methods = choose_methods(recipe, model, surface, arriving, sticking, request);
        trace_species(recipe, model, surface, sticking, request, shared, arriving);
        arriving.trace->traces = traces;
        if (!any) return arriving;
        std::vector<std::vector<double>> next = reacted(model, time, arriving, points);
        arriving.trace->coverage_change = mean_change(arriving.wedges, arriving.coverage, next);
        arriving.coverage = std::move(next);
        const bool settled = !pulsed && !(arriving.trace->coverage_change > coverages.tolerance);
        if (!settled && traces < most) continue;
        // Sites are taken now, and so will they be in the time steps that follow.
        if (!choose) return arriving;
        choose = false;
        const std::vector<SpeciesMethod> before =
            std::exchange(shared.methods, choose_methods(recipe, model, surface, arriving,
                                                         sticking_left(model, surface, arriving), request));
        arriving.trace->methods = shared.methods;
        if (std::ranges::equal(before, shared.methods, {}, &SpeciesMethod::radiosity,
                               &SpeciesMethod::radiosity))
            return arriving;
        shared = {shared.methods, {}, {}};
        arriving.trace.reset();
        most = traces + coverages.most_iterations;
    }
}

std::vector<double> sticking_left(const Model& model, const TracedSurface& surface,
                                  const SurfaceFlux& arriving) {
    return sticking_of(model, arriving, wedge_points(model, surface, arriving));
}

std::vector<std::vector<double>> later_coverages(const Model& model, const TracedSurface& surface,
                                                 double time) {
    const SurfaceFlux& arriving = *surface.arriving;
    return reacted(model, time, arriving, wedge_points(model, surface, arriving));
}

}  // namespace sidewall::app
