#include "levelset/layers/cut_layers.hpp"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

// The value that marks a released node, which cut_layers sets: below all that a narrow band holds.
float as_marked(float value, float background) {
    return value - 4.0f * background;
}
bool is_released(float value, float background) {
    return value < -2.0f * background;
}
// The value before its release, but for rounding.
float before_release(float value, float background) {
    return value + 4.0f * background;
}

// What is known of a layer below at the nodes of one leaf of the surface.
struct LeafNodes {
    Leaf* layer;         // the layer's leaf there, null if it has none
    bool released;       // whether any node is released
    bool any_overgrown;  // whether any node is outside the layer, in a film that grows there
    RowBits overgrown;   // those nodes; set if there are any
};

template <class Is>
void set_bits(RowBits& bits, Is&& is) {
    for (std::size_t row = 0; row < bits.size(); ++row) {
        unsigned of_row = 0;
        for (std::size_t z = 0; z < 8; ++z) of_row |= static_cast<unsigned>(is(8 * row + z)) << z;
        bits[row] = static_cast<std::uint8_t>(of_row);
    }
}

void release(Leaf* layer, const Leaf& surface, const float* old, float background, LeafNodes& nodes) {
    nodes.layer = layer;
    nodes.released = nodes.any_overgrown = false;
    if (!layer) return;
    const float* moved = surface.buffer().data();
    float* value = layer->buffer().data();
    int released = 0, overgrown = 0;
    // Nodes off the band hold the background.
    for (std::size_t i = 0; i < Leaf::SIZE; ++i) {
        const bool bare = (std::abs(value[i]) < background) & (value[i] == old[i]) & (moved[i] >= value[i]);
        released |= bare;
        overgrown |= (value[i] >= 0.0f) & (moved[i] < 0.0f) & (moved[i] < old[i]);
        value[i] = bare ? as_marked(value[i], background) : value[i];
    }
    nodes.released = released != 0;
    nodes.any_overgrown = overgrown != 0;
    if (overgrown)
        set_bits(nodes.overgrown,
                 [&](std::size_t i) { return (value[i] >= 0.0f) & (moved[i] < 0.0f) & (moved[i] < old[i]); });
}

// Restores a layer's released nodes that lie beside overgrown ones.
class Keeper {
  public:
    // \param nodes  those of the layer: entry \p stride * n belongs to leaf n.
    Keeper(const Domain& domain, std::span<Leaf* const> leaves, const surface::LeafTable& table,
           const float* before, const LeafNodes* nodes, std::size_t stride)
        : domain_(domain), leaves_(leaves), table_(table), before_(before), nodes_(nodes), stride_(stride) {}

    // Restores nodes beside the overgrown ones of leaf \p n. Thread-safe.
    void keep_beside(std::size_t n, float background) const {
        if (!nodes(n).any_overgrown || !releases_near(n)) return;
        const openvdb::Coord origin = leaves_[n]->origin();
        std::array<int, 10> own_x, own_y;  // of the nodes -1 .. 8 of the leaf
        for (int k = 0; k < 10; ++k) {
            own_x[static_cast<std::size_t>(k)] = domain_.source_node(0, origin.x() + k - 1);
            own_y[static_cast<std::size_t>(k)] = domain_.source_node(1, origin.y() + k - 1);
        }
        for (std::size_t i = 0; i < Leaf::SIZE; ++i) {
            if (!has(nodes(n).overgrown, i)) continue;
            const std::size_t x = i >> 6, y = i >> 3 & 7;
            const int z = origin.z() + static_cast<int>(i & 7);
            for (std::size_t k = 0; k < 27; ++k) {
                const openvdb::Coord q(own_x[x + k / 9], own_y[y + k / 3 % 3],
                                       z + static_cast<int>(k % 3) - 1);
                const bool here = (q & ~7) == origin;
                const std::int32_t leaf = here ? 0 : table_.find(q.x() >> 3, q.y() >> 3, q.z() >> 3);
                if (leaf >= 0)
                    keep(here ? n : static_cast<std::size_t>(leaf), Leaf::coordToOffset(q), background);
            }
        }
    }

  private:
    const LeafNodes& nodes(std::size_t leaf) const { return nodes_[leaf * stride_]; }

    // Several leaves may write the same value to a node at once.
    void keep(std::size_t leaf, openvdb::Index node, float background) const {
        const float old = before_[leaf * Leaf::SIZE + node];
        if (!nodes(leaf).released || !(old < 0.0f)) return;
        const std::atomic_ref value(nodes(leaf).layer->buffer().data()[node]);
        if (is_released(value.load(std::memory_order_relaxed), background))
            value.store(old, std::memory_order_relaxed);
    }

    bool releases_near(std::size_t n) const {
        const openvdb::Coord o = leaves_[n]->origin();
        static constexpr int kBeside[] = {-1, 0, 8};
        for (std::size_t k = 0; k < 27; ++k) {
            const int x = o.x() + kBeside[k / 9], y = o.y() + kBeside[k / 3 % 3],
                      z = (o.z() >> 3) + static_cast<int>(k % 3) - 1;
            const std::int32_t leaf =
                table_.find(domain_.source_node(0, x) >> 3, domain_.source_node(1, y) >> 3, z);
            if (leaf >= 0 && nodes(static_cast<std::size_t>(leaf)).released) return true;
        }
        return false;
    }

    const Domain& domain_;
    const std::span<Leaf* const> leaves_;
    const surface::LeafTable& table_;
    const float* before_;
    const LeafNodes* nodes_;
    const std::size_t stride_;
};

// Adds leaves to a layer where the surface's band has one inside the layer and the layer has none.
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

// Adds voxels to a layer at nodes of the surface's band that lie inside the layer and have none yet.
void expose(Leaf& leaf, const Leaf& above, bool made) {
    Nodes added = above.getValueMask();
    added -= leaf.getValueMask();
    for (auto it = added.beginOn(); it; ++it)
        if (made || leaf.getValue(it.pos()) < 0.0f) leaf.setValueOn(it.pos(), above.getValue(it.pos()));
}

// The new value of a released node: the surface's, unless that is lower than the old one by more than
// \p most. Then a film has closed over the node, and the layer's front stays.
float follow(float old, float surface, float most) {
    return surface < old - most ? old : surface;
}

// Sets phi = max(phi, surface) on the surface's band. Elsewhere the layer is unchanged, or gone.
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
            if (is_made) flood(leaf);  // elsewhere it holds the outside background
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

Grown mark_exposed(MaterialStack& stack, std::span<Leaf* const> leaves, const surface::LeafTable& table,
                   const float* before) {
    const float background = stack.top().background();
    Grown grown{table, LargeVector<RowBits>(leaves.size())};
    const std::size_t below = stack.layers.size() - 1;
    LargeVector<LeafNodes> nodes(leaves.size() * below);  // leaf by leaf
    surface::parallel_each(leaves.size(), 4, [&](std::size_t n) {
        const float *moved = leaves[n]->buffer().data(), *old = before + n * Leaf::SIZE;
        set_bits(grown.nodes[n], [&](std::size_t i) { return moved[i] < old[i]; });
        for (std::size_t k = 0; k < below; ++k)
            release(stack.layers[k].phi->tree().probeLeaf(leaves[n]->origin()), *leaves[n], old, background,
                    nodes[n * below + k]);
    });
    surface::parallel_each(leaves.size(), 4, [&](std::size_t n) {
        for (std::size_t k = 0; k < below; ++k)
            Keeper(stack.domain, leaves, table, before, &nodes[k], below).keep_beside(n, background);
    });
    return grown;
}

}  // namespace sidewall::levelset
