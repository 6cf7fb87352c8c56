#include "levelset/stack.hpp"

#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/body.hpp"
#include "levelset/redistance.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

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
    const double margin = 2.0 * kHalfWidth * domain.spacing;
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
        redistance(*layer.phi, domain, 8);
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

LayerDepths::LayerDepths(const MaterialStack& stack)
    : stack_(stack),
      dx_(static_cast<float>(stack.domain.spacing)),
      top_(stack.top().getConstUnsafeAccessor()) {
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k)
        layers_.push_back(stack.layers[k].phi->getConstUnsafeAccessor());
}

openvdb::Coord LayerDepths::own(const openvdb::Coord& node) const {
    return {stack_.domain.source_node(0, node.x()), stack_.domain.source_node(1, node.y()), node.z()};
}

bool LayerDepths::solid(const openvdb::Coord& own_node) const {
    return top_.isValueOn(own_node) && top_.getValue(own_node) <= 0.0f;
}

// A layer that has no voxel here lies deeper than the band: only exposed layers share the surface's voxels.
float LayerDepths::value(std::size_t layer, const openvdb::Coord& own_node) const {
    return layers_[layer].isValueOn(own_node) ? layers_[layer].getValue(own_node) : stack_.top().background();
}

LayerDepths::Reading LayerDepths::read(std::size_t layer, const openvdb::Coord& node,
                                       const Vec3& point) const {
    const openvdb::Coord here = own(node);
    const float layer_value = value(layer, here), surface = top_.getValue(here),
                thickness = layer_value - surface;
    Reading reading;
    if (thickness <= static_cast<float>(kExposed) * dx_) return reading;  // exposed
    reading.depth = layer_value;
    for (int axis = 0; axis < 3; ++axis) {
        // From neighbours inside alone, on both sides or on one.
        float run = 0.0f;
        for (const int side : {-1, 1}) {
            openvdb::Coord next = node;
            next[axis] += side;
            next = own(next);
            if (!solid(next)) continue;
            const auto sign = static_cast<float>(side);
            reading.rise[axis] += sign * (value(layer, next) - layer_value);
            reading.surface_rise[axis] += sign * (top_.getValue(next) - surface);
            run += 1.0f;
        }
        if (run == 0.0f) continue;
        reading.rise[axis] /= run;
        reading.surface_rise[axis] /= run;
        reading.depth += reading.rise[axis] * static_cast<float>(point[axis] - node[axis]);
    }
    // Under a film the two rise alike, and their difference is its thickness; extrapolating errs by the
    // film's curvature, which matters most where it is thin.
    constexpr float kThin = 0.25f, kParallel = 0.9f, kThinParallel = 0.5f;
    const float parallel = thickness < kThin * dx_ ? kThinParallel : kParallel;
    if (reading.rise.dot(reading.surface_rise) > parallel * reading.rise.norm() * reading.surface_rise.norm())
        reading.depth = thickness;
    return reading;
}

void LayerDepths::at(const Vec3& point, std::span<float> depth) const {
    const Domain& domain = stack_.domain;
    const Vec3 floor(std::floor(point.x()), std::floor(point.y()), std::floor(point.z()));
    const openvdb::Coord low(static_cast<int>(floor.x()), static_cast<int>(floor.y()),
                             static_cast<int>(floor.z()));
    std::array<openvdb::Coord, 8> corners;
    std::array<float, 8> weights{};  // trilinear, of the corners inside
    float sum = 0.0f;
    for (int n = 0; n < 8; ++n) {
        const openvdb::Coord step(n & 1, n >> 1 & 1, n >> 2);
        const auto k = static_cast<std::size_t>(n);
        corners[k] = low + step;
        double weight = 1.0;
        for (int axis = 0; axis < 3; ++axis) weight *= 1.0 - std::abs(point[axis] - floor[axis] - step[axis]);
        if (solid(own(corners[k]))) sum += weights[k] = static_cast<float>(weight);
    }
    constexpr float kLeast = 1e-3f;  // less is rounding about a face of the cell
    if (sum < kLeast) {
        // Material thinner than a cell: the values as they are.
        const Vec3 world(domain.min[0] + point.x() * domain.spacing,
                         domain.min[1] + point.y() * domain.spacing, point.z() * domain.spacing);
        const double surface = distance_at(stack_.top(), domain, world);
        for (std::size_t k = 0; k < layers_.size(); ++k)
            depth[k] = static_cast<float>(distance_at(*stack_.layers[k].phi, domain, world) - surface);
        return;
    }
    const float touching = static_cast<float>(kExposed) * dx_;
    for (std::size_t k = 0; k < layers_.size(); ++k) {
        Reading mean;
        for (std::size_t n = 0; n < 8; ++n) {
            if (weights[n] == 0.0f) continue;
            const Reading reading = read(k, corners[n], point);
            const float weight = weights[n] / sum;
            mean.depth += weight * reading.depth;
            mean.rise += weight * reading.rise;
            mean.surface_rise += weight * reading.surface_rise;
        }
        depth[k] = mean.depth;
        if (depth[k] > touching) continue;
        // In a layer, or at its end where the surface leaves it straight into the next one?
        constexpr float kStraight = 0.5f;
        const float length = mean.surface_rise.norm();
        const float along = length > 0.0f ? -mean.rise.dot(mean.surface_rise) / (length * dx_) : 0.0f;
        if (along <= kStraight)
            depth[k] = 0.0f;
        else
            depth[k] = depth[k] < -touching ? depth[k] / along : 2.0f * touching;
    }
    // No layer lies above the one over it. Where several materials meet under a film, each by itself is
    // harder to tell than all of them together.
    for (std::size_t k = layers_.size(); k-- > 1;)
        if (depth[k] > touching) depth[k - 1] = std::max(depth[k - 1], depth[k]);
}

std::size_t exposed_layer(const MaterialStack& stack, const Vec3& point) {
    std::vector<float> depth(stack.layers.size() - 1);
    LayerDepths(stack).at(stack.domain.to_index(point), depth);
    for (std::size_t k = 0; k < depth.size(); ++k)
        if (static_cast<double>(depth[k]) <= kExposed * stack.domain.spacing) return k;
    return stack.layers.size() - 1;
}

int exposed_material(const MaterialStack& stack, const Vec3& point) {
    return stack.layers[exposed_layer(stack, point)].material;
}

}  // namespace sidewall::levelset
