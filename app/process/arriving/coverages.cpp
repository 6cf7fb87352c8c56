#include "app/process/arriving/coverages.hpp"

#include "app/process/arriving/diffusion.hpp"
#include "flux/radiosity/method_choice.hpp"

namespace sidewall::app {
namespace {

// Linearised reaction of one coverage, by wedge: d theta/dt = source - decay theta near its present value.
struct Reaction {
    std::vector<double> source, decay;
};

// \param takes_part  by wedge.
Reaction reaction_of(const Model& model, std::size_t k, const SurfaceFlux& arriving,
                     const WedgePoints& points, const std::vector<std::uint8_t>& takes_part) {
    constexpr double kDifference = 1e-6;  // increment of a coverage for the numerical derivative
    const std::size_t count = points.materials.size();
    Reaction reaction{std::vector<double>(count), std::vector<double>(count)};
    each_wedge(arriving, points, [&](std::size_t w, const SurfacePoint& point) {
        if (!takes_part[w]) return;
        const double rate = model.coverages.rate(k, point);
        std::vector<double> theta(point.coverage.begin(), point.coverage.end());
        const double step = kDifference * std::max(1.0, std::abs(theta[k]));
        const double before = theta[k];
        theta[k] += step;
        SurfacePoint moved = point;
        moved.coverage = theta;
        const double slope = (model.coverages.rate(k, moved) - rate) / (theta[k] - before);
        // A rate that rises with the coverage (self-amplifying) is kept explicit.
        reaction.decay[w] = std::max(0.0, -slope);
        reaction.source[w] = rate + reaction.decay[w] * before;
    });
    return reaction;
}

// Means of values by wedge over the nodes' wedges, weighted by area.
struct NodeMeans {
    const DiffusionElements& elements;
    const flux::Wedges& wedges;
    const std::vector<std::uint8_t>& takes_part;  // by wedge

    template <class Use>
    void each(Use&& use) const {
        for (std::size_t v = 0; v + 1 < wedges.first.size(); ++v)
            for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w)
                for (std::uint32_t i = elements.first[v]; i < elements.first[v + 1]; ++i)
                    if (takes_part[w]) use(w, elements.node[i], elements.weight[i]);
    }
    std::vector<double> operator()(const std::vector<double>& values) const {
        std::vector<double> sum(elements.area.size(), 0.0), weight(elements.area.size(), 0.0);
        each([&](std::uint32_t w, std::uint32_t node, double share) {
            // A wedge without area counts only if the node has no other.
            const double part = share * std::max(wedges.area[w], 1e-300);
            sum[node] += part * values[w];
            weight[node] += part;
        });
        for (std::size_t i = 0; i < sum.size(); ++i)
            if (weight[i] > 0.0) sum[i] /= weight[i];
        return sum;
    }
};

// Lets the diffusing coverages react and spread along the traced surface together: finite elements on its
// triangles, backward Euler in time, reactions linearised (first stage of a Rosenbrock method), so that long
// time steps reach the joint steady state. Diffusion crosses creases and periodic sides, but not reflective
// sides or the edge of a material with D = 0.
// \param after  by coverage and wedge: result of reactions alone; replaced for coverages that diffuse.
void diffuse_coverages(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving,
                       const WedgePoints& points, double time, std::vector<std::vector<double>>& after) {
    const flux::Wedges& wedges = arriving.wedges;
    for (const std::size_t k : model.coverages.diffusing) {
        std::vector<double> diffusivity(wedges.count(), 0.0);
        each_wedge(arriving, points, [&](std::size_t w, const SurfacePoint& point) {
            diffusivity[w] = model.coverages.diffusivity(k, point);
        });
        std::vector<double> by_triangle(surface.traced().triangles.size());
        // A wedge with D = 0 takes part if it shares a triangle with one that diffuses.
        std::vector<std::uint8_t> takes_part(wedges.count(), 0);
        for (std::size_t t = 0; t < by_triangle.size(); ++t) {
            const std::uint32_t* corner = &wedges.corner[3 * t];
            for (std::size_t c = 0; c < 3; ++c) by_triangle[t] += diffusivity[corner[c]] / 3.0;
            for (std::size_t c = 0; c < 3 && by_triangle[t] > 0.0; ++c) takes_part[corner[c]] = 1;
        }
        const Reaction reaction = reaction_of(model, k, arriving, points, takes_part);
        const DiffusionElements elements = diffusion_elements(surface.traced(), by_triangle, surface.box);
        const NodeMeans means{elements, wedges, takes_part};
        const std::vector<double> nodes = diffused(elements, means(arriving.coverage[k]), time,
                                                   means(reaction.source), means(reaction.decay));
        std::vector<double> spread(wedges.count(), 0.0);
        means.each(
            [&](std::uint32_t w, std::uint32_t node, double share) { spread[w] += share * nodes[node]; });
        for (std::size_t w = 0; w < wedges.count(); ++w)
            if (takes_part[w]) after[k][w] = spread[w];
    }
}

// Positions of the wedges; empty unless Model::depends_on_position.
std::vector<Vec3> wedge_positions(const Model& model, const TriangleMesh& mesh, const flux::Wedges& wedges) {
    std::vector<Vec3> positions(model.depends_on_position ? wedges.count() : 0);
    for (std::size_t c = 0; c < wedges.corner.size() && !positions.empty(); ++c)
        positions[wedges.corner[c]] = mesh.vertices[mesh.triangles[c / 3][c % 3]];
    return positions;
}

// Sticking that follows from the coverages, by species and wedge; empty if they do not affect it.
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

// Reduces sticking and emission by what steady coverages exchange with the given fluxes, see leaving_of.
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
    return reacted(model, 0.0, arriving, points);  // steady coverages follow the transient ones
}

}  // namespace sidewall::app
