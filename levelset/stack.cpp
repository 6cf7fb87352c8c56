#include "levelset/stack.hpp"

#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/body.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/redistance.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

// How far beyond a body's surface its band is looked for, in dx: the band, and as much again, because a bound
// of the distance is smaller than the distance and makes it wider.
constexpr double kMargin = 2.0 * kHalfWidth;

// phi = max(phi, surface) on the surface's band; elsewhere nothing can have changed, or all of it is gone.
void cut(Grid& phi, const Grid& surface, const Domain& domain) {
    const auto snap = static_cast<float>(kExposed * domain.spacing);
    const float background = phi.background();
    // A node of the surface's band that the layer has no voxel for yet: inside, it becomes one; outside, it
    // stays out.
    std::vector<std::pair<openvdb::Coord, float>> exposed;
    std::vector<openvdb::Coord> made;  // origins of the leaves they are in that are new, in ascending order
    const auto layer = phi.getConstUnsafeAccessor();
    for (auto leaf = surface.tree().cbeginLeaf(); leaf; ++leaf) {
        const Leaf* own = layer.probeConstLeaf(leaf->origin());
        if (own && own->getValueMask() == leaf->getValueMask()) continue;
        // A missing leaf lies wholly on one side.
        if (!own && !inside(phi, leaf->cbeginValueOn().getCoord())) continue;
        if (!own) made.push_back(leaf->origin());
        for (auto it = leaf->cbeginValueOn(); it; ++it)
            if (!own || (!own->isValueOn(it.pos()) && own->getValue(it.pos()) < 0.0f))
                exposed.emplace_back(it.getCoord(), *it);
    }
    auto writer = phi.getAccessor();
    for (const auto& [c, v] : exposed) writer.setValueOn(c, v);
    std::sort(made.begin(), made.end());
    openvdb::tree::LeafManager<Grid::TreeType> leaves(phi.tree());
    const openvdb::tools::SignedFloodFillOp<Grid::TreeType> flood(phi.tree());
    leaves.foreach ([&](Leaf& leaf, std::size_t) {
        // A leaf made just now has the outside background everywhere else.
        if (std::binary_search(made.begin(), made.end(), leaf.origin())) flood(leaf);
        const auto top = surface.getConstUnsafeAccessor();
        const Leaf* above = top.probeConstLeaf(leaf.origin());
        const auto first = leaf.cbeginValueOn();
        if (!first) return;
        const float far = !above && inside(surface, first.getCoord()) ? -background : background;
        float* value = leaf.buffer().data();
        for (auto it = leaf.beginValueOn(); it; ++it) {
            const openvdb::Index n = it.pos();
            const float s = above ? above->getValue(n) : far;
            if (value[n] < s + snap) value[n] = s;
        }
    });
}

}  // namespace

MaterialStack make_stack(const Domain& domain, const std::vector<std::pair<int, Shape>>& bodies) {
    MaterialStack stack{domain, {}};
    std::vector<Body> below;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const double margin = kMargin * domain.spacing;
    for (const auto& [material, shape] : bodies) {
        below.push_back(make_body(shape, domain));
        low = std::min(low, below.back().low);
        high = std::max(high, below.back().high);
        const auto united = [&](const Vec3& p) {
            double d = below.front().distance(p);
            for (std::size_t k = 1; k < below.size(); ++k) d = std::min(d, below[k].distance(p));
            return d;
        };
        Layer layer{material, sample_grid(domain, united, low - margin, high + margin)};
        if (layer.phi->activeVoxelCount() == 0)
            throw GeometryError(
                "a layer has no surface inside the domain: check its shape, position and size");
        redistance(*layer.phi, domain, kSweepsAnew);
        stack.layers.push_back(layer);
    }
    cut_layers(stack);
    return stack;
}

MaterialStack copy(const MaterialStack& stack) {
    MaterialStack result = stack;
    for (Layer& layer : result.layers) layer.phi = layer.phi->deepCopy();
    return result;
}

void begin_film(MaterialStack& stack, int material) {
    if (stack.layers.back().material == material) return;
    stack.layers.push_back({material, stack.top().deepCopy()});
}

void cut_layers(MaterialStack& stack) {
    const Grid& surface = stack.top();
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k) {
        cut(*stack.layers[k].phi, surface, stack.domain);
        trim_band(*stack.layers[k].phi, stack.domain);
    }
}

}  // namespace sidewall::levelset
