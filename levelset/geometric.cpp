#include "levelset/geometric.hpp"

#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/openvdb_grid.hpp"
#include "levelset/redistance.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

using LeafManager = openvdb::tree::LeafManager<Grid::TreeType>;

// The level set whose value at every node near either front is combine(a, b): unions, cuts, differences.
// Every point of its front lies on one of theirs, so their bands hold its own. A distance again afterwards.
template <class Combine>
GridPtr combined(const Domain& domain, const Grid& a, const Grid& b, Combine&& combine) {
    GridPtr result = a.deepCopy();
    result->tree().topologyUnion(b.tree());
    const float background = a.background();
    LeafManager leaves(result->tree());
    tbb::parallel_for(std::size_t{0}, leaves.leafCount(), [&](std::size_t n) {
        Leaf& leaf = leaves.leaf(n);
        const auto in_a = a.getConstUnsafeAccessor(), in_b = b.getConstUnsafeAccessor();
        const Leaf* own[] = {in_a.probeConstLeaf(leaf.origin()), in_b.probeConstLeaf(leaf.origin())};
        const Grid* grid[] = {&a, &b};
        for (openvdb::Index k = 0; k < Leaf::SIZE; ++k) {
            float value[2];
            for (int i = 0; i < 2; ++i)
                value[i] = own[i]                                          ? own[i]->getValue(k)
                           : inside(*grid[i], leaf.offsetToGlobalCoord(k)) ? -background
                                                                           : background;
            const float v = combine(value[0], value[1]);
            const bool on = leaf.isValueOn(k) && std::abs(v) < background;
            leaf.setValueOnly(k, on ? v : std::copysign(background, v));
            leaf.setActiveState(k, on);
        }
    });
    trim_band(*result, domain);
    if (result->activeVoxelCount() > 0) redistance(*result, domain, kSweepsAnew);
    return result;
}

GridPtr plane(const Domain& domain, double height) {
    const double margin = 2.0 * kHalfWidth * domain.spacing;
    return sample_grid(
        domain, [height](const Vec3& p) { return p.z() - height; }, height - margin, height + margin);
}

}  // namespace

void planarize(MaterialStack& stack, double height) {
    const GridPtr above = plane(stack.domain, height);
    for (Layer& layer : stack.layers)
        layer.phi = combined(stack.domain, *layer.phi, *above,
                             [](float solid, float z) { return std::max(solid, z); });
    cut_layers(stack);
}

void fill(MaterialStack& stack, int material, double height) {
    begin_film(stack, material);
    const GridPtr below = plane(stack.domain, height);
    Layer& film = stack.layers.back();
    film.phi =
        combined(stack.domain, *film.phi, *below, [](float solid, float z) { return std::min(solid, z); });
    cut_layers(stack);
}

void strip(MaterialStack& stack, int material) {
    if (stack.layers.front().material == material)
        throw GeometryError("strip: the substrate cannot be taken away: name another material");
    for (std::size_t k = 1; k < stack.layers.size();) {
        if (stack.layers[k].material != material) {
            ++k;
            continue;
        }
        // The film: inside its own level set, outside the one below. All above it lose it too.
        const GridPtr film = combined(stack.domain, *stack.layers[k].phi, *stack.layers[k - 1].phi,
                                      [](float own, float below) { return std::max(own, -below); });
        for (std::size_t j = k + 1; j < stack.layers.size(); ++j)
            stack.layers[j].phi = combined(stack.domain, *stack.layers[j].phi, *film,
                                           [](float solid, float gone) { return std::max(solid, -gone); });
        stack.layers.erase(stack.layers.begin() + static_cast<std::ptrdiff_t>(k));
    }
    cut_layers(stack);
}

void conformal(MaterialStack& stack, int material, double thickness) {
    begin_film(stack, material);
    Grid& surface = stack.top();
    const double most = 0.5 * stack.domain.spacing;
    const int parts = static_cast<int>(std::ceil(thickness / most));
    const auto part = static_cast<float>(thickness / std::max(1, parts));
    const float limit = std::nextafter(surface.background(), 0.0f);
    for (int n = 0; n < parts; ++n) {
        LeafManager leaves(surface.tree());
        leaves.foreach ([&](Leaf& leaf, std::size_t) {
            for (auto it = leaf.beginValueOn(); it; ++it) it.setValue(std::clamp(*it - part, -limit, limit));
        });
        redistance(surface, stack.domain, 3);
    }
    cut_layers(stack);
}

}  // namespace sidewall::levelset
