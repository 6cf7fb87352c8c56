#include "levelset/layers/stack.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// The share of a node's cell inside a front, which is taken for a plane across an axis.
float share(float phi, float dx) {
    return std::clamp(0.5f - phi / dx, 0.0f, 1.0f);
}

// The share of a node's cell that lies within the domain; in an axial one, the cell's ring, in cells.
double weight(const Domain& domain, const openvdb::Coord& node) {
    double weight = 1.0;
    for (std::size_t a = 0; a < 2; ++a) {
        const int n = node[static_cast<int>(a)];
        if (domain.side[a] == Side::reflective && (n == 0 || n == domain.cells[a])) weight *= 0.5;
    }
    // The radius of the cell's middle; at the axis and at the rim, of the half cell's.
    if (domain.axial)
        weight *= 2.0 * std::numbers::pi *
                  std::clamp<double>(node.x(), 0.25, static_cast<double>(domain.cells[0]) - 0.25);
    return weight;
}

// volume_left of one level where it counts. \p finer: the next finer level, or null.
double volume_of_level(const MaterialStack& stack, std::size_t layer, double enough, std::size_t& start,
                       const MaterialStack* finer) {
    const Grid& own = *stack.layers[layer].phi;
    const Grid* below = layer > 0 ? stack.layers[layer - 1].phi.get() : nullptr;
    const auto dx = static_cast<float>(stack.domain.spacing),
               touching = static_cast<float>(thinnest_film(stack.domain));
    const double cell = std::pow(stack.domain.spacing, 3);
    std::vector<const Leaf*> leaves;
    own.tree().getNodes(leaves);
    double volume = 0.0;
    const std::size_t first = start;
    for (std::size_t n = 0; n < leaves.size(); ++n) {
        const std::size_t index = (first + n) % leaves.size();
        const Leaf& leaf = *leaves[index];
        const Leaf* under = below != nullptr ? below->tree().probeConstLeaf(leaf.origin()) : nullptr;
        double here = 0.0;
        for (auto value = leaf.cbeginValueOn(); value; ++value) {
            // Only near the layer's front: where both fronts coincide, their bands may differ at the rim.
            if (std::abs(*value) > 1.5f * dx) continue;
            const float lower =
                under != nullptr ? under->getValue(value.pos()) : std::numeric_limits<float>::max();
            if (lower - *value <= touching) continue;
            const openvdb::Coord node = value.getCoord();
            if (!counts_at(stack, finer, node.x(), node.y())) continue;
            here += weight(stack.domain, node) * static_cast<double>(share(*value, dx) - share(lower, dx));
        }
        if (volume == 0.0 && here > 0.0) start = index;
        volume += cell * here;
        if (volume >= enough && volume > 0.0) break;
    }
    return volume;
}

}  // namespace

MaterialStack copy(const MaterialStack& stack) {
    MaterialStack result = stack;
    for (Layer& layer : result.layers) layer.phi = layer.phi->deepCopy();
    if (stack.coarser) result.coarser = std::make_shared<MaterialStack>(copy(*stack.coarser));
    return result;
}

void begin_film(MaterialStack& stack, int material) {
    if (stack.layers.back().material == material) return;
    stack.layers.push_back({material, stack.top().deepCopy()});
    if (stack.coarser) begin_film(*stack.coarser, material);
}

double volume_left(const MaterialStack& stack, std::size_t layer, double enough, std::size_t& start) {
    double volume = 0.0;
    const MaterialStack* finer = nullptr;
    for (const MaterialStack* level = &stack; level != nullptr; finer = level, level = level->coarser.get()) {
        volume += volume_of_level(*level, layer, enough - volume, start, finer);
        if (volume >= enough && volume > 0.0) break;
    }
    return volume;
}

bool drop_spent_layers(MaterialStack& stack, std::span<const double> volumes) {
    const double cell = std::pow(stack.domain.finest_spacing(), 3);
    const std::size_t before = stack.layers.size();
    for (std::size_t k = before - 1; k-- > 1;) {
        std::size_t start = 0;
        if (volumes[k] >= cell || volume_left(stack, k, cell, start) >= cell) continue;
        for (MaterialStack* level = &stack; level != nullptr; level = level->coarser.get())
            level->layers.erase(level->layers.begin() + static_cast<std::ptrdiff_t>(k));
    }
    return stack.layers.size() < before;
}

}  // namespace sidewall::levelset
