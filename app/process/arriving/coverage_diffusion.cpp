#include "app/process/arriving/coverage_diffusion.hpp"

#include <algorithm>
#include <cmath>

#include "app/process/arriving/diffusion.hpp"

namespace sidewall::app {
namespace {

// The reactions of one coverage, by wedge: d/dt = source - decay theta near the value it has.
struct Reaction {
    std::vector<double> source, decay;
};

// \param takes_part  by wedge.
Reaction reaction_of(const Model& model, std::size_t k, const SurfaceFlux& arriving,
                     const WedgePoints& points, const std::vector<std::uint8_t>& takes_part) {
    constexpr double kDifference = 1e-6;  // of a coverage, for its derivative
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
        // Growth that feeds on itself is followed forwards.
        reaction.decay[w] = std::max(0.0, -slope);
        reaction.source[w] = rate + reaction.decay[w] * before;
    });
    return reaction;
}

PeriodicSides periodic_sides(const flux::LateralBox& box) {
    PeriodicSides sides;
    for (std::size_t a = 0; a < 2; ++a) {
        sides.periodic[a] = box.boundary[a] == flux::Boundary::periodic;
        sides.min[a] = box.min[a];
        sides.max[a] = box.max[a];
    }
    return sides;
}

// Means over the nodes' wedges, by area.
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
            // A wedge without area counts where no other does.
            const double part = share * std::max(wedges.area[w], 1e-300);
            sum[node] += part * values[w];
            weight[node] += part;
        });
        for (std::size_t i = 0; i < sum.size(); ++i)
            if (weight[i] > 0.0) sum[i] /= weight[i];
        return sum;
    }
};

}  // namespace

void diffuse_coverages(const Model& model, const TracedSurface& surface, const SurfaceFlux& arriving,
                       const WedgePoints& points, double time, std::vector<std::vector<double>>& after) {
    const flux::Wedges& wedges = arriving.wedges;
    for (const std::size_t k : model.coverages.diffusing) {
        std::vector<double> diffusivity(wedges.count(), 0.0);
        each_wedge(arriving, points, [&](std::size_t w, const SurfacePoint& point) {
            diffusivity[w] = model.coverages.diffusivity(k, point);
        });
        std::vector<double> by_triangle(surface.traced().triangles.size());
        // Where nothing moves at a point, something may at its neighbours, which share triangles with it.
        std::vector<std::uint8_t> takes_part(wedges.count(), 0);
        for (std::size_t t = 0; t < by_triangle.size(); ++t) {
            const std::uint32_t* corner = &wedges.corner[3 * t];
            for (std::size_t c = 0; c < 3; ++c) by_triangle[t] += diffusivity[corner[c]] / 3.0;
            for (std::size_t c = 0; c < 3 && by_triangle[t] > 0.0; ++c) takes_part[corner[c]] = 1;
        }
        const Reaction reaction = reaction_of(model, k, arriving, points, takes_part);
        const DiffusionElements elements =
            diffusion_elements(surface.traced(), by_triangle, periodic_sides(surface.box));
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

}  // namespace sidewall::app
