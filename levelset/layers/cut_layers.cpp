#include "levelset/layers/cut_layers.hpp"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <vector>

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// Makes the leaves of the surface's band that lie inside the layer and that it has none for.
// \returns their origins, in ascending order.
std::vector<openvdb::Coord> make_exposed_leaves(Grid& phi, const Grid& surface) {
    std::vector<const Leaf*> above;
    surface.tree().getNodes(above);
    std::vector<std::uint8_t> missing(above.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, above.size(), 8), [&](const auto& range) {
        const auto layer = phi.getConstUnsafeAccessor();
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const openvdb::Coord& origin = above[n]->origin();
            // A missing leaf lies wholly on one side.
            missing[n] = !layer.probeConstLeaf(origin) && inside(phi, above[n]->cbeginValueOn().getCoord());
        }
    });
    std::vector<openvdb::Coord> made;
    for (std::size_t n = 0; n < above.size(); ++n)
        if (missing[n]) made.push_back(above[n]->origin());
    for (const openvdb::Coord& origin : made) phi.tree().touchLeaf(origin);
    std::sort(made.begin(), made.end());
    return made;
}

// A node of the surface's band that the layer has no voxel for yet: inside, it becomes one; outside, it stays
// out.
void expose(Leaf& leaf, const Leaf& above, bool made) {
    Nodes added = above.getValueMask();
    added -= leaf.getValueMask();
    for (auto it = added.beginOn(); it; ++it)
        if (made || leaf.getValue(it.pos()) < 0.0f) leaf.setValueOn(it.pos(), above.getValue(it.pos()));
}

// A released node follows the surface, by little. One that is suddenly deep under it has been closed over by
// a film: there the layer's front stays.
float follow(float old, float surface, float most) {
    return surface < old - most ? old : surface;
}

// phi = max(phi, surface) on the surface's band; elsewhere nothing can have changed, or all of it is gone.
void cut(Grid& phi, const Grid& surface, const Domain& domain, const Grown* grown) {
    const auto snap = static_cast<float>(thinnest_film(domain));
    const float background = phi.background(), most = 0.5f * static_cast<float>(domain.spacing);
    const std::vector<openvdb::Coord> made = make_exposed_leaves(phi, surface);
    std::vector<Leaf*> leaves;
    phi.tree().getNodes(leaves);
    const openvdb::tools::SignedFloodFillOp<Grid::TreeType> flood(phi.tree());
    std::atomic<bool> any_empty{false};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 4), [&](const auto& range) {
        const auto top = surface.getConstUnsafeAccessor();
        for (std::size_t k = range.begin(); k != range.end(); ++k) {
            Leaf& leaf = *leaves[k];
            const Leaf* above = top.probeConstLeaf(leaf.origin());
            const bool is_made = std::binary_search(made.begin(), made.end(), leaf.origin());
            if (above) expose(leaf, *above, is_made);
            if (is_made) flood(leaf);  // it has the outside background everywhere else
            const auto first = leaf.cbeginValueOn();
            const float far = !above && first && inside(surface, first.getCoord()) ? -background : background;
            const RowBits* grew = grown ? grown->in(leaf.origin()) : nullptr;
            float* value = leaf.buffer().data();
            for (auto it = leaf.beginValueOn(); it; ++it) {
                const openvdb::Index n = it.pos();
                const float s = above ? above->getValue(n) : far;
                if (is_released(value[n], background))
                    value[n] = follow(before_release(value[n], background), s, most);
                else if (value[n] < (grew && has(*grew, n) ? s : s + snap))
                    value[n] = s;
            }
            if (!trim_leaf(leaf, domain, background)) any_empty = true;
        }
    });
    if (any_empty) openvdb::tools::pruneInactive(phi.tree());
}

}  // namespace

void cut_layers(MaterialStack& stack, const Grown* grown) {
    const Grid& surface = stack.top();
    tbb::parallel_for(std::size_t{0}, stack.layers.size() - 1,
                      [&](std::size_t k) { cut(*stack.layers[k].phi, surface, stack.domain, grown); });
}

}  // namespace sidewall::levelset
