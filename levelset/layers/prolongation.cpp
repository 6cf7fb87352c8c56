#include "levelset/layers/prolongation.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "levelset/block.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

using CoarseBlock = Block<2>;

// Number of coarse nodes along an axis that a fine leaf is interpolated from; the first lies before it.
constexpr int kReached = 7;
constexpr int kFine = 8;

// Values at a node, interpolated along one axis after the other.
struct Interpolated {
    float cubic = 0.0f, linear = 0.0f;
    float farthest = 0.0f;  // the largest absolute value that the cubic is made of
};

// Interpolates fine node \p t along an axis from coarse values \p at(n), n = 0 .. kReached - 1.
template <class At>
Interpolated along(int t, At&& at) {
    const int c = (t >> 1) + 1;
    if (t % 2 == 0) return at(c);
    const Interpolated a = at(c - 1), b = at(c), d = at(c + 1), e = at(c + 2);
    return {(9.0f * (b.cubic + d.cubic) - (a.cubic + e.cubic)) / 16.0f, 0.5f * (b.linear + d.linear),
            std::max(std::max(a.farthest, b.farthest), std::max(d.farthest, e.farthest))};
}

// The fine leaf's values in the octant \p corner (each 0 or 1) of a coarse leaf, in a leaf's order.
void interpolate(const CoarseBlock& block, const openvdb::Coord& corner, float background,
                 std::array<float, Leaf::SIZE>& out) {
    constexpr std::size_t kR = kReached, kF = kFine;
    std::array<Interpolated, kR * kR * kF> along_z;
    std::array<Interpolated, kR * kF * kF> along_y;
    for (int x = 0; x < kReached; ++x)
        for (int y = 0; y < kReached; ++y) {
            const int first =
                CoarseBlock::at(4 * corner.x() - 1 + x, 4 * corner.y() - 1 + y, 4 * corner.z() - 1);
            const auto value = [&](int n) {
                const float v = block.value[static_cast<std::size_t>(first + n)];
                return Interpolated{v, v, std::abs(v)};
            };
            for (int z = 0; z < kFine; ++z)
                along_z[(static_cast<std::size_t>(x) * kR + static_cast<std::size_t>(y)) * kF +
                        static_cast<std::size_t>(z)] = along(z, value);
        }
    for (std::size_t x = 0; x < kR; ++x)
        for (std::size_t z = 0; z < kF; ++z)
            for (int y = 0; y < kFine; ++y)
                along_y[(x * kF + static_cast<std::size_t>(y)) * kF + z] =
                    along(y, [&](int n) { return along_z[(x * kR + static_cast<std::size_t>(n)) * kF + z]; });
    for (std::size_t y = 0; y < kF; ++y)
        for (std::size_t z = 0; z < kF; ++z)
            for (int x = 0; x < kFine; ++x) {
                const Interpolated v =
                    along(x, [&](int n) { return along_y[(static_cast<std::size_t>(n) * kF + y) * kF + z]; });
                out[(static_cast<std::size_t>(x) * kF + y) * kF + z] =
                    v.farthest < background ? v.cubic : v.linear;
            }
}

// Raises values of a layer that are below those of the layer above; values that exceed them by less than
// \p snap become equal.
void keep_below(const Grid& above, const openvdb::Coord& origin, float snap,
                std::array<float, Leaf::SIZE>& values) {
    const Leaf* leaf = above.getConstUnsafeAccessor().probeConstLeaf(origin);
    if (leaf == nullptr) return;
    const float* top = leaf->buffer().data();
    for (std::size_t n = 0; n < Leaf::SIZE; ++n)
        if (values[n] < top[n] + snap) values[n] = top[n];
}

// Gives a leaf the values that are within the narrow band, and the background elsewhere.
// \returns whether there are any.
bool assign(Leaf& leaf, const std::array<float, Leaf::SIZE>& values, const Domain& domain, float background) {
    Nodes active;
    const openvdb::Coord origin = leaf.origin();
    float* own = leaf.buffer().data();
    for (openvdb::Index row = 0; row < 64; ++row) {
        const bool owned =
            domain.owns(origin.x() + static_cast<int>(row >> 3), origin.y() + static_cast<int>(row & 7));
        for (openvdb::Index n = 8 * row; n < 8 * row + 8; ++n) {
            const bool near = owned && std::abs(values[n]) < background;
            own[n] = near ? values[n] : std::copysign(background, values[n]);
            if (near) active.setOn(n);
        }
    }
    leaf.setValueMask(active);
    return !active.isOff();
}

LeafColumn source_of(const LeafColumns& columns, const openvdb::Coord& origin) {
    return columns.at(origin.x() >> 3, origin.y() >> 3);
}

// Leaves to remove from a layer, and leaves to add.
struct Changes {
    std::vector<openvdb::Coord> gone;
    std::vector<std::unique_ptr<Leaf>> made;
};

void prolongate_layer(MaterialStack& stack, std::size_t layer, const LeafColumns& columns) {
    Grid& fine = *stack.layers[layer].phi;
    const Domain &domain = stack.domain, &coarse_domain = stack.coarser->domain;
    const Grid& coarse = *stack.coarser->layers[layer].phi;
    const bool has_above = layer + 1 < stack.layers.size();
    const auto snap = static_cast<float>(thinnest_film(domain));
    std::vector<const Leaf*> leaves;
    coarse.tree().getNodes(leaves);
    const surface::LeafTable table(leaves);
    const LeafData data(table, leaves);
    std::vector<openvdb::Coord> gone;
    for (auto leaf = fine.tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord o = leaf->origin();
        const LeafColumn source = source_of(columns, o);
        const bool orphan =
            source == LeafColumn::interpolated && table.find(o.x() >> 4, o.y() >> 4, o.z() >> 4) < 0;
        if (source == LeafColumn::none || orphan) gone.push_back(o);
    }
    tbb::enumerable_thread_specific<Changes> changes;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 4), [&](const auto& range) {
        Changes& mine = changes.local();
        auto accessor = fine.getUnsafeAccessor();
        CoarseBlock block;
        std::array<float, Leaf::SIZE> values;
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const openvdb::Coord low = leaves[n]->origin() << 1;
            bool loaded = false;
            for (int part = 0; part < 8; ++part) {
                const openvdb::Coord corner(part >> 2, part >> 1 & 1, part & 1);
                const openvdb::Coord origin = low.offsetBy(8 * corner.x(), 8 * corner.y(), 8 * corner.z());
                if (!domain.owns(origin.x(), origin.y()) ||
                    source_of(columns, origin) != LeafColumn::interpolated)
                    continue;
                if (!loaded) load_block(data, coarse_domain, *leaves[n], coarse.background(), block);
                loaded = true;
                interpolate(block, corner, coarse.background(), values);
                if (has_above) keep_below(*stack.layers[layer + 1].phi, origin, snap, values);
                Leaf* leaf = accessor.probeLeaf(origin);
                if (leaf != nullptr) {
                    if (!assign(*leaf, values, domain, fine.background())) mine.gone.push_back(origin);
                    continue;
                }
                auto made = std::make_unique<Leaf>(origin, fine.background(), false);
                if (assign(*made, values, domain, fine.background())) mine.made.push_back(std::move(made));
            }
        }
    });
    for (const openvdb::Coord& origin : gone) fine.tree().addTile(1, origin, fine.background(), false);
    for (Changes& some : changes) {
        for (const openvdb::Coord& origin : some.gone)
            fine.tree().addTile(1, origin, fine.background(), false);
        for (auto& leaf : some.made) fine.tree().addLeaf(leaf.release());
    }
}

// Makes the coarse leaves that the fine level's voxels need and that are missing. Beyond the columns they
// take the signs of the fine level's margin, which is a leaf wide at least.
void make_missing(const Grid& fine, const LevelColumns& columns, const Domain& coarse_domain, Grid& coarse) {
    std::vector<openvdb::Coord> missing;
    const auto present = coarse.getConstUnsafeAccessor();
    for (auto leaf = fine.tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord o = leaf->origin();
        if (!columns.of_node(o.x(), o.y()) || leaf->isEmpty()) continue;
        const openvdb::Coord to((o.x() >> 4) << 3, (o.y() >> 4) << 3, (o.z() >> 4) << 3);
        if (present.probeConstLeaf(to) == nullptr) missing.push_back(to);
    }
    for (const openvdb::Coord& origin : missing) {
        if (coarse.tree().probeConstLeaf(origin) != nullptr) continue;
        auto made = std::make_unique<Leaf>(origin, coarse.background(), false);
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            const openvdb::Coord c = made->offsetToGlobalCoord(n);
            const bool in = coarse_domain.owns(c.x(), c.y()) && inside(fine, c << 1);
            made->setValueOnly(n, in ? -coarse.background() : coarse.background());
        }
        coarse.tree().addLeaf(made.release());
    }
}

// Injects into the octant of a coarse leaf that begins at \p low. \p from: the fine leaf there, or null.
void inject_eighth(const Grid& fine, const Leaf* from, const openvdb::Coord& low, const Domain& coarse_domain,
                   Leaf& leaf) {
    const float beyond = fine.background();  // least distance from the front of a node off the fine band
    const float* values = from != nullptr ? from->buffer().data() : nullptr;
    float* own = leaf.buffer().data();
    for (int row = 0; row < 16; ++row) {
        const openvdb::Coord c = low.offsetBy(row >> 2, row & 3, 0);
        if (!coarse_domain.owns(c.x(), c.y())) continue;
        openvdb::Index to = Leaf::coordToOffset(c), at = Leaf::coordToOffset(c << 1);
        for (int z = 0; z < 4; ++z, ++to, at += 2) {
            float value = own[to];
            if (from != nullptr && from->isValueOn(at)) {
                value = values[at];
            } else {
                const bool near = std::abs(value) < beyond;
                if (from == nullptr && !near) continue;
                const bool in = from != nullptr ? values[at] < 0.0f : inside(fine, c.offsetBy(0, 0, z) << 1);
                if (!near && in == (value < 0.0f)) continue;
                value = in ? -beyond : beyond;
            }
            own[to] = value;
            leaf.setActiveState(to, true);
        }
    }
}

void inject_leaf(const Grid& fine, const LevelColumns& columns, const Domain& coarse_domain, Leaf& leaf) {
    const auto accessor = fine.getConstUnsafeAccessor();
    for (int part = 0; part < 8; ++part) {
        const openvdb::Coord low =
            leaf.origin().offsetBy(4 * (part >> 2), 4 * (part >> 1 & 1), 4 * (part & 1));
        if (coarse_domain.owns(low.x(), low.y()) && columns.of_coarser_node(low.x(), low.y()))
            inject_eighth(fine, accessor.probeConstLeaf(low << 1), low, coarse_domain, leaf);
    }
}

}  // namespace

void prolongate(MaterialStack& stack, const LeafColumns& columns) {
    for (std::size_t k = stack.layers.size(); k-- > 0;) prolongate_layer(stack, k, columns);
}

void inject(MaterialStack& stack, const LevelColumns& columns) {
    MaterialStack& to = *stack.coarser;
    for (std::size_t k = 0; k < stack.layers.size(); ++k) {
        const Grid& fine = *stack.layers[k].phi;
        Grid& coarse = *to.layers[k].phi;
        make_missing(fine, columns, to.domain, coarse);
        std::vector<Leaf*> leaves;
        coarse.tree().getNodes(leaves);
        surface::parallel_each(leaves.size(), 16,
                               [&](std::size_t n) { inject_leaf(fine, columns, to.domain, *leaves[n]); });
    }
}

}  // namespace sidewall::levelset
