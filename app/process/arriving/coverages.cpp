#include "app/process/arriving/coverages.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/process/arriving/coverage_diffusion.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/arriving/flux_reuse.hpp"
#include "app/process/arriving/species_flux.hpp"
#include "app/process/arriving/wedge_points.hpp"
#include "flux/radiosity/method_choice.hpp"

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

// How species leave the surface, by species and wedge; each list empty where the species say all.
struct Leaving {
    std::vector<double> sticking, emission;
};

// What desorbs where a coverage is in steady state with the flux G that keeps it up goes off like what does
// not stick, by Lambert's law: sticking s with a desorption d is sticking s - d/G, and none is left to emit
// where G s > d. Both say the same when G is what arrives; this way what comes and goes many times settles
// with the trace, not by turns of it.
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

// \param before  fluxes by tally and wedge that coverages in steady state come from; empty: they are not, or
// it is not known.
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

// As carry; but a surface that stands still keeps its values to the last bit, which by look-ups would creep
// from time step to time step.
std::vector<std::vector<double>> kept_or_carried(const SurfaceField& field,
                                                 const std::vector<std::string>& names,
                                                 const TriangleMesh& mesh, const flux::Wedges& wedges) {
    if (!field.scene || !std::ranges::equal(field.scene->triangles(), mesh.triangles) ||
        !std::ranges::equal(field.scene->vertices(), mesh.vertices))
        return carry(field, names, mesh, wedges);
    std::vector<std::vector<double>> kept(names.size(), std::vector<double>(wedges.count(), 0.0));
    for (std::size_t k = 0; k < names.size(); ++k) {
        const auto found = std::find(field.names.begin(), field.names.end(), names[k]);
        if (found == field.names.end()) continue;
        const std::vector<double>& corner =
            field.corner[static_cast<std::size_t>(found - field.names.begin())];
        for (std::size_t c = 0; c < corner.size(); ++c) kept[k][wedges.corner[c]] = corner[c];
    }
    return kept;
}

// Whether coverages are in steady state with the fluxes.
bool are_steady(const Coverages& coverages) {
    return !coverages.names.empty() && !(coverages.pulse > 0.0) && !coverages.transient;
}

}  // namespace

WedgePoints wedge_points(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving) {
    return {wedge_materials(arriving), wedge_positions(model, surface.traced(), arriving.wedges),
            surface.time};
}

SurfaceFlux settled_fluxes(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                           SurfaceFlux arriving, const SurfaceField& carried, const TraceRequest& request) {
    const WedgePoints points = wedge_points(model, surface, arriving);
    const Coverages& coverages = model.coverages;
    const bool pulsed = coverages.pulse > 0.0, any = !coverages.names.empty();
    if (pulsed)
        arriving.coverage.assign(coverages.names.size(), std::vector<double>(points.materials.size(), 0.0));
    else if (any)
        arriving.coverage = kept_or_carried(carried, coverages.names, surface.traced(), arriving.wedges);
    const double time = pulsed ? coverages.pulse / coverages.parts : 0.0;
    SharedTraces shared{request.methods, {}, {}, {}};
    const bool steady = are_steady(coverages);
    std::vector<std::vector<double>> before;
    if (model.desorption && steady) {
        before = kept_or_carried(carried, carried_names(model), surface.traced(), arriving.wedges);
        before.resize(before.size() - coverages.names.size());
    }
    // Anew when the coverages have settled.
    bool choose = recipe.flux.method == "auto" && model.sticking && request.settle && !pulsed &&
                  !are_of(model, request.methods);
    int most = !any ? 1 : pulsed ? coverages.parts : request.settle ? coverages.most_iterations : 1;
    for (int traces = 1;; ++traces) {
        const auto [sticking, emission] =
            leaving_of(model, arriving, points, steady && traces > 1 ? arriving.flux : before);
        if (!are_of(model, shared.methods))
            shared.methods = choose_methods(recipe, model, surface, arriving, sticking, request);
        // Sites are taken up in a pulse, and errors fall: those of its first part tell how many rays to
        // gather, those of its last are reported.
        TraceRequest part = request;
        part.errors = !pulsed || traces == 1 || traces == most;
        trace_species(recipe, model, surface, sticking, emission, part, shared, arriving);
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
        const std::vector<SpeciesMethod> chosen =
            std::exchange(shared.methods, choose_methods(recipe, model, surface, arriving,
                                                         sticking_left(model, surface, arriving), request));
        arriving.trace->methods = shared.methods;
        if (std::ranges::equal(chosen, shared.methods, {}, &SpeciesMethod::radiosity,
                               &SpeciesMethod::radiosity))
            return arriving;
        shared = {shared.methods, {}, {}, {}};
        arriving.trace.reset();
        most = traces + coverages.most_iterations;
    }
}

std::vector<double> sticking_left(const Model& model, const TracedSurface& surface,
                                  const SurfaceFlux& arriving) {
    return leaving_of(model, arriving, wedge_points(model, surface, arriving),
                      are_steady(model.coverages) ? arriving.flux : std::vector<std::vector<double>>())
        .sticking;
}

std::vector<std::vector<double>> later_coverages(const Model& model, const TracedSurface& surface,
                                                 double time) {
    SurfaceFlux arriving = *surface.arriving;
    const WedgePoints points = wedge_points(model, surface, arriving);
    std::vector<std::vector<double>> next = reacted(model, time, arriving, points);
    if (model.coverages.diffusing.empty() || !(time > 0.0)) return next;
    diffuse_coverages(model, surface, arriving, points, time, next);
    arriving.coverage = std::move(next);
    return reacted(model, 0.0, arriving, points);  // the steady ones, around those
}

}  // namespace sidewall::app
