#include "levelset/release.hpp"

#include <tbb/parallel_for.h>

#include <array>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "surface/leaf_table.hpp"

namespace sidewall::levelset {
namespace {

// Nodes of one leaf of the surface, as a layer below sees them.
struct LeafNodes {
    Leaf* layer = nullptr;              // its leaf there, if it has one
    bool released = false;              // whether any is
    std::bitset<Leaf::SIZE> overgrown;  // outside the layer, in a film that grows there
};

template <class Use>
void each(std::size_t count, Use&& use) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 32), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) use(n);
    });
}

LeafNodes release(Leaf* layer, const Leaf& surface, const float* old, float mark) {
    LeafNodes nodes{layer, false, {}};
    if (!layer) return nodes;
    const float background = -0.5f * mark;
    const float* moved = surface.buffer().data();
    float* value = layer->buffer().data();
    int released = 0, overgrown = 0;
    // Off the band values are the background.
    for (std::size_t i = 0; i < Leaf::SIZE; ++i) {
        const bool bare = (std::abs(value[i]) < background) & (value[i] == old[i]) & (moved[i] >= value[i]);
        released |= bare;
        overgrown |= (value[i] >= 0.0f) & (moved[i] < 0.0f) & (moved[i] < old[i]);
        value[i] = bare ? mark : value[i];
    }
    nodes.released = released != 0;
    if (overgrown)
        for (std::size_t i = 0; i < Leaf::SIZE; ++i)
            nodes.overgrown[i] = value[i] >= 0.0f && moved[i] < 0.0f && moved[i] < old[i];
    return nodes;
}

// Gives the released nodes beside those overgrown their values back.
class Keeper {
  public:
    Keeper(const Domain& domain, std::span<Leaf* const> leaves, const float* before,
           const std::vector<LeafNodes>& nodes, const surface::LeafTable& table, float mark)
        : domain_(domain), leaves_(leaves), before_(before), nodes_(nodes), table_(table), mark_(mark) {}

    using Place = std::pair<std::size_t, openvdb::Index>;

    std::vector<Place> beside(std::size_t n) const {
        std::vector<Place> places;
        if (nodes_[n].overgrown.none() || !releases_near(n)) return places;
        const openvdb::Coord origin = leaves_[n]->origin();
        std::array<int, 10> own_x, own_y;  // of the nodes -1 .. 8 of the leaf
        for (int k = 0; k < 10; ++k) {
            own_x[static_cast<std::size_t>(k)] = domain_.source_node(0, origin.x() + k - 1);
            own_y[static_cast<std::size_t>(k)] = domain_.source_node(1, origin.y() + k - 1);
        }
        for (std::size_t i = 0; i < Leaf::SIZE; ++i) {
            if (!nodes_[n].overgrown[i]) continue;
            const std::size_t x = i >> 6, y = i >> 3 & 7;
            const int z = origin.z() + static_cast<int>(i & 7);
            for (std::size_t k = 0; k < 27; ++k) {
                const openvdb::Coord q(own_x[x + k / 9], own_y[y + k / 3 % 3],
                                       z + static_cast<int>(k % 3) - 1);
                const bool here = (q & ~7) == origin;
                const std::int32_t leaf = here ? 0 : table_.find(q.x() >> 3, q.y() >> 3, q.z() >> 3);
                if (leaf < 0) continue;
                const std::size_t m = here ? n : static_cast<std::size_t>(leaf);
                const openvdb::Index node = Leaf::coordToOffset(q);
                if (nodes_[m].released && nodes_[m].layer->getValue(node) == mark_ && old(m, node) < 0.0f)
                    places.emplace_back(m, node);
            }
        }
        return places;
    }

    void keep(const Place& place) const {
        nodes_[place.first].layer->setValueOnly(place.second, old(place.first, place.second));
    }

  private:
    float old(std::size_t leaf, openvdb::Index node) const { return before_[leaf * Leaf::SIZE + node]; }

    bool releases_near(std::size_t n) const {
        const openvdb::Coord o = leaves_[n]->origin();
        for (int k = 0; k < 27; ++k) {
            const int x = o.x() + (k / 9 == 0   ? -1
                                   : k / 9 == 1 ? 0
                                                : 8),
                      y = o.y() + (k / 3 % 3 == 0   ? -1
                                   : k / 3 % 3 == 1 ? 0
                                                    : 8);
            const std::int32_t leaf = table_.find(domain_.source_node(0, x) >> 3,
                                                  domain_.source_node(1, y) >> 3, (o.z() >> 3) + k % 3 - 1);
            if (leaf >= 0 && nodes_[static_cast<std::size_t>(leaf)].released) return true;
        }
        return false;
    }

    const Domain& domain_;
    const std::span<Leaf* const> leaves_;
    const float* before_;
    const std::vector<LeafNodes>& nodes_;
    const surface::LeafTable& table_;
    const float mark_;
};

}  // namespace

Grown release_exposed(MaterialStack& stack, std::span<Leaf* const> leaves, const float* before) {
    const float mark = -2.0f * stack.top().background();
    Grown grown{surface::LeafTable(std::vector<Leaf*>(leaves.begin(), leaves.end())),
                std::vector<Grown::Nodes>(leaves.size())};
    each(leaves.size(), [&](std::size_t n) {
        const float *moved = leaves[n]->buffer().data(), *old = before + n * Leaf::SIZE;
        for (std::size_t i = 0; i < Leaf::SIZE; ++i) grown.nodes[n][i] = moved[i] < old[i];
    });
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k) {
        auto& tree = stack.layers[k].phi->tree();
        std::vector<LeafNodes> nodes(leaves.size());
        each(nodes.size(), [&](std::size_t n) {
            nodes[n] =
                release(tree.probeLeaf(leaves[n]->origin()), *leaves[n], before + n * Leaf::SIZE, mark);
        });
        const Keeper keeper(stack.domain, leaves, before, nodes, grown.table, mark);
        std::vector<std::vector<Keeper::Place>> kept(nodes.size());
        each(nodes.size(), [&](std::size_t n) { kept[n] = keeper.beside(n); });
        for (const auto& places : kept)
            for (const Keeper::Place& place : places) keeper.keep(place);
    }
    return grown;
}

}  // namespace sidewall::levelset
