#include "levelset/meshes/fronts.hpp"

#include <algorithm>
#include <cmath>

#include "levelset/meshes/continued.hpp"

namespace sidewall::levelset {
namespace {

// In cells, the film with which a layer counts as covered: marching cubes cuts off less than kCovering of a
// convex corner, through which a thinner film's surface would pass; a hollow one it fills. So much of it is
// asked for at the ends of edges of the grid that the layer's front crosses: these lie within a cell of it.
constexpr double kCovering = 0.5, kCoveringHollow = 0.25, kBesideFront = 1.0;

}  // namespace

Fronts::Fronts(const MaterialStack& stack) {
    const MaterialStack* finer = nullptr;
    for (const MaterialStack* at = &stack; at != nullptr; finer = at, at = at->coarser.get()) {
        Level level{at, continued_fronts(*at, finer), {}, {}};
        for (const Layer& layer : at->layers) level.own.push_back(layer.phi->getConstUnsafeAccessor());
        for (const GridPtr& front : level.grids) level.continued.push_back(front->getConstUnsafeAccessor());
        level.continued.push_back(at->top().getConstUnsafeAccessor());
        levels_.push_back(std::move(level));
    }
}

std::size_t Fronts::level_of(const Vec3& point) const {
    for (std::size_t n = 0; n + 1 < levels_.size(); ++n) {
        const Domain& domain = levels_[n].stack->domain;
        const Vec3 index = domain.to_index(point);
        constexpr double kBeside = 0.25;  // of a cell: the columns on both sides of a node between two
        for (const double x : {-kBeside, kBeside})
            for (const double y : {-kBeside, kBeside}) {
                const auto node = [&](int axis, double beside) {
                    const double i = std::floor(index[axis] + beside);
                    return std::clamp(static_cast<int>(i), 0, domain.last_node(axis));
                };
                if (levels_[n].stack->columns.of_node(node(0, x), node(1, y))) return n;
            }
    }
    return levels_.size() - 1;
}

GridEdge Fronts::edge_of(const Vec3& point) const {
    GridEdge edge;
    edge.level = level_of(point);
    const Domain& domain = levels_[edge.level].stack->domain;
    const Vec3 index = domain.to_index(point);
    std::array<int, 3> low{};
    std::array<double, 3> off{};
    for (int a = 0; a < 3; ++a) {
        const auto k = static_cast<std::size_t>(a);
        off[k] = std::abs(index[a] - std::round(index[a]));
        if (off[k] > off[static_cast<std::size_t>(edge.axis)]) edge.axis = a;
        low[k] = static_cast<int>(std::round(index[a]));
    }
    const auto a = static_cast<std::size_t>(edge.axis);
    constexpr double kRounding = 1e-6;
    edge.is_one = levels_.size() == 1 || (off[(a + 1) % 3] < kRounding && off[(a + 2) % 3] < kRounding);
    low[a] = static_cast<int>(std::floor(index[edge.axis]));
    edge.t = index[edge.axis] - low[a];
    for (int end = 0; end < 2; ++end) {
        std::array<int, 3> node = low;
        node[a] += end;
        edge.node[static_cast<std::size_t>(end)] = {domain.source_node(0, node[0]),
                                                    domain.source_node(1, node[1]), node[2]};
    }
    return edge;
}

surface::SharpEdges edges_below(const MaterialStack& stack, std::size_t layer) {
    const MaterialStack* finer = nullptr;
    double least = kCovering;
    for (const MaterialStack* level = &stack; level != nullptr; finer = level, level = level->coarser.get()) {
        const double dx = level->domain.spacing;
        const auto near = static_cast<float>(kBesideFront * dx);
        const auto next = level->layers[layer + 1].phi->getConstUnsafeAccessor();
        for (auto it = level->layers[layer].phi->cbeginValueOn(); it; ++it) {
            if (std::abs(*it) > near) continue;
            float above = 0.0f;  // a node that is not in the next layer's band lies inside it
            if (!next.probeValue(it.getCoord(), above)) continue;
            const double film = static_cast<double>(*it - above) / dx;
            if (film >= least || !counts_at(*level, finer, it.getCoord().x(), it.getCoord().y())) continue;
            least = film;
            if (least < kCoveringHollow) return surface::SharpEdges::none;
        }
    }
    return least < kCovering ? surface::SharpEdges::hollow : surface::SharpEdges::all;
}

}  // namespace sidewall::levelset
