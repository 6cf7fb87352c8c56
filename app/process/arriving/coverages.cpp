#include "app/process/arriving/coverages.hpp"

#include <algorithm>

#include "app/process/arriving/coverage_diffusion.hpp"
#include "flux/radiosity/method_choice.hpp"

namespace sidewall::app {
namespace {

// Positions of the wedges; empty unless the model asks.
std::vector<Vec3> wedge_positions(const Model& model, const TriangleMesh& mesh, const flux::Wedges& wedges) {
    std::vector<Vec3> positions(model.depends_on_position ? wedges.count() : 0);
    for (std::size_t c = 0; c < wedges.corner.size() && !positions.empty(); ++c)
        positions[wedges.corner[c]] = mesh.vertices[mesh.triangles[c / 3][c % 3]];
    return positions;
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

// Sticking and emission of coverages that balance the fluxes given, as leaving_of says.
void balance(const Model& model, const std::vector<std::vector<double>>& flux, std::size_t wedges,
             Leaving& leaving) {
    std::size_t tally = 0;
    for (std::size_t k = 0; k < model.species.size(); tally += flux::tally_count(model.species[k]), ++k)
        for (std::size_t w = 0; w < wedges && model.species[k].desorbs; ++w) {
            double& sticking = leaving.sticking[k * wedges + w];
            double& emission = leaving.emission[k * wedges + w];
            const double arriving = flux[tally][w], stays = sticking * arriving;
            if (!(arriving > 0.0)) continue;
            sticking = stays > emission ? std::min(sticking, (stays - emission) / arriving) : 0.0;
            emission = std::max(0.0, emission - stays);
        }
}

}  // namespace

WedgePoints wedge_points(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving) {
    return {flux::wedge_materials(arriving.wedges, arriving.materials),
            wedge_positions(model, surface.traced(), arriving.wedges), surface.time};
}

bool are_steady(const Coverages& coverages) {
    return !coverages.names.empty() && !(coverages.pulse > 0.0) && !coverages.transient;
}

Leaving leaving_of(const Model& model, const SurfaceFlux& arriving, const WedgePoints& points,
                   const std::vector<std::vector<double>>& before) {
    Leaving leaving{sticking_of(model, arriving, points), {}};
    if (!model.desorption) return leaving;
    const std::size_t count = points.materials.size();
    if (leaving.sticking.empty())
        for (const flux::Species& species : model.species) {
            const auto own = flux::sticking_by_wedge(arriving.wedges, arriving.materials, species);
            leaving.sticking.insert(leaving.sticking.end(), own.begin(), own.end());
        }
    leaving.emission.resize(model.species.size() * count);
    each_wedge(arriving, points, [&](std::size_t w, const SurfacePoint& point) {
        for (std::size_t k = 0; k < model.species.size(); ++k)
            leaving.emission[k * count + w] = model.desorption(k, point);
    });
    if (!before.empty()) balance(model, before, count, leaving);
    return leaving;
}

std::vector<double> sticking_left(const Model& model, const TracedSurface& surface,
                                  const SurfaceFlux& arriving) {
    return leaving_of(model, arriving, wedge_points(model, surface, arriving),
                      are_steady(model.coverages) ? arriving.flux : std::vector<std::vector<double>>())
        .sticking;
}

std::vector<std::vector<double>> reacted(const Model& model, double time, const SurfaceFlux& arriving,
                                         const WedgePoints& points,
                                         const std::vector<std::vector<double>>& flux_before) {
    std::vector<std::vector<double>> next = arriving.coverage;
    if (!flux_before.empty()) {
        SurfaceFlux middle = arriving;
        for (std::size_t k = 0; k < middle.flux.size(); ++k)
            for (std::size_t w = 0; w < middle.flux[k].size(); ++w)
                middle.flux[k][w] = std::max(0.0, 1.5 * middle.flux[k][w] - 0.5 * flux_before[k][w]);
        return reacted(model, time, middle, points);
    }
    each_wedge(arriving, points, [&](std::size_t w, const SurfacePoint& point) {
        std::vector<double> theta(point.coverage.begin(), point.coverage.end());
        model.coverages.react(point, time, theta);
        for (std::size_t k = 0; k < theta.size(); ++k) next[k][w] = theta[k];
    });
    return next;
}

std::vector<std::vector<double>> coverages_after(const Model& model, const TracedSurface& surface,
                                                 double dt) {
    if (!model.coverages.transient) return surface.arriving->coverage;
    SurfaceFlux arriving = *surface.arriving;
    const WedgePoints points = wedge_points(model, surface, arriving);
    std::vector<std::vector<double>> next = reacted(model, dt, arriving, points);
    if (model.coverages.diffusing.empty() || !(dt > 0.0)) return next;
    diffuse_coverages(model, surface, arriving, points, dt, next);
    arriving.coverage = std::move(next);
    return reacted(model, 0.0, arriving, points);  // the steady ones, around those
}

}  // namespace sidewall::app
