#include "levelset/band.hpp"

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

// Active voxels of a leaf: bit 8 y + z of word x stands for node (x, y, z).
using Mask = std::array<std::uint64_t, 8>;
constexpr std::uint64_t kLowZ = 0x0101010101010101u, kHighZ = kLowZ << 7;
constexpr std::uint64_t kLowY = 0xff, kHighY = kLowY << 56;

Mask mask_of(const Leaf& leaf) {
    Mask mask;
    for (openvdb::Index x = 0; x < 8; ++x) mask[x] = leaf.getValueMask().getWord<std::uint64_t>(x);
    return mask;
}

// Minimum number of leaves per task: the masks of fewer take less time than waking another thread.
constexpr std::size_t kLeavesOfTask = 256;

// Distance, in nodes, that a re-distancing reads: two sweeps of two nodes each.
constexpr int kReadReach = 4;

// Coordinates along one axis of all leaves that a re-distancing of the leaf at `origin` may read.
struct LeavesAlong {
    std::array<int, 6> place{};
    std::size_t count = 0;

    LeavesAlong(const Domain& domain, int axis, int origin) {
        const int last = std::min(origin + 7, domain.last_node(axis));
        for (const int node : {origin - kReadReach, origin - 1, origin, last, last + 1, last + kReadReach}) {
            const int leaf = domain.source_node(axis, node) >> 3;
            if (std::find(begin(), end(), leaf) == end()) place[count++] = leaf;
        }
    }
    const int* begin() const { return place.data(); }
    const int* end() const { return place.data() + count; }
};

// Calls use(n) with the numbers of all leaves that a re-distancing of the leaf at \p origin may read.
template <class Use>
void each_around(const surface::LeafTable& table, const Domain& domain, const openvdb::Coord& origin,
                 Use&& use) {
    const bool inner = origin.x() >= 8 && origin.y() >= 8 && origin.x() + 15 <= domain.last_node(0) &&
                       origin.y() + 15 <= domain.last_node(1);
    const auto column = [&](int x, int y) {
        for (int z = -1; z <= 1; ++z) {
            const std::int32_t n = table.find(x, y, (origin.z() >> 3) + z);
            if (n >= 0) use(static_cast<std::size_t>(n));
        }
    };
    if (inner) {
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y) column((origin.x() >> 3) + x, (origin.y() >> 3) + y);
        return;
    }
    const LeavesAlong ys(domain, 1, origin.y());
    for (const int x : LeavesAlong(domain, 0, origin.x()))
        for (const int y : ys) column(x, y);
}

// The own nodes of the domain in plane \p x of a leaf, as a word of a Mask.
std::uint64_t own_voxels(const Domain& domain, const openvdb::Coord& origin, int x) {
    if (origin.x() + x < 0 || origin.x() + x > domain.last_node(0) || origin.y() < 0) return 0;
    const int rows = domain.last_node(1) - origin.y() + 1;
    return rows >= 8 ? ~std::uint64_t{0} : rows <= 0 ? 0 : (std::uint64_t{1} << (8 * rows)) - 1;
}

// The mask and all face neighbours of its voxels. \p around: masks of the leaves beside it, as in kFaces.
Mask grown(const Mask& own, const std::array<const Mask*, 6>& around) {
    static constexpr Mask kEmpty{};
    const auto side = [&](std::size_t n) -> const Mask& { return around[n] ? *around[n] : kEmpty; };
    Mask result;
    for (std::size_t x = 0; x < 8; ++x) {
        const std::uint64_t w = own[x];
        result[x] = w | (w & ~kHighZ) << 1 | (w & ~kLowZ) >> 1 | w << 8 | w >> 8;
        result[x] |= x > 0 ? own[x - 1] : side(0)[7];
        result[x] |= x < 7 ? own[x + 1] : side(1)[0];
        result[x] |= side(2)[x] >> 56 | side(3)[x] << 56;
        result[x] |= (side(4)[x] & kHighZ) >> 7 | (side(5)[x] & kLowZ) << 7;
    }
    return result;
}

constexpr std::array<std::array<int, 3>, 6> kFaces = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

// Bit f is set if the leaf has voxels on its face f (kFaces).
unsigned faces_touched(const Mask& m) {
    std::uint64_t all = 0;
    for (const std::uint64_t w : m) all |= w;
    return (m[0] != 0) | (m[7] != 0) << 1 | ((all & kLowY) != 0) << 2 | ((all & kHighY) != 0) << 3 |
           ((all & kLowZ) != 0) << 4 | ((all & kHighZ) != 0) << 5;
}

// Voxels of the leaf at an origin.
struct LeafVoxels {
    openvdb::Coord origin;
    Mask mask;
};

// The voxels in plane \p from across \p axis (0 or 1), moved to plane \p to; no others.
Mask moved_plane(const Mask& mask, int axis, int from, int to) {
    Mask moved{};
    if (axis == 0) {
        moved[static_cast<std::size_t>(to)] = mask[static_cast<std::size_t>(from)];
    } else {
        for (std::size_t x = 0; x < 8; ++x) moved[x] = (mask[x] >> 8 * from & kLowY) << 8 * to;
    }
    return moved;
}

// Neighbours of the awake leaves' voxels across a periodic side: they lie at the domain's other end.
std::vector<LeafVoxels> across_sides(const Band& band, const Domain& domain) {
    std::vector<LeafVoxels> carried;
    for (int axis = 0; axis < 2; ++axis) {
        if (domain.side[static_cast<std::size_t>(axis)] != Side::periodic) continue;
        const int last = domain.last_node(axis);
        for (const auto& [from, to] : {std::pair{0, last}, {last, 0}})
            for (const std::uint32_t n : band.awake) {
                const Leaf& leaf = *band.leaves[n];
                openvdb::Coord origin = leaf.origin();
                if (origin[axis] != (from & ~7)) continue;
                const Mask mask = moved_plane(mask_of(leaf), axis, from & 7, to & 7);
                if (mask == Mask{}) continue;
                origin[axis] = to & ~7;
                carried.push_back({origin, mask});
            }
    }
    return carried;
}

// Makes the missing leaves that the band grows into, and rebuilds the band's lists.
void make_leaves(Band& band, Grid& grid, const Domain& domain, const std::vector<LeafVoxels>& carried) {
    const auto beside = [&](std::uint32_t leaf, std::size_t face) {
        return band.leaves[leaf]->origin().offsetBy(8 * kFaces[face][0], 8 * kFaces[face][1],
                                                    8 * kFaces[face][2]);
    };
    std::vector<std::uint8_t> grows(band.awake.size());  // bit f: over face f, where there is no leaf
    surface::parallel_each(grows.size(), kLeavesOfTask, [&](std::size_t k) {
        const unsigned faces = faces_touched(mask_of(*band.leaves[band.awake[k]]));
        for (std::size_t f = 0; f < 6; ++f) {
            if ((faces >> f & 1) == 0) continue;
            const openvdb::Coord to = beside(band.awake[k], f);
            if (domain.owns(to.x(), to.y()) && band.table.find(to.x() >> 3, to.y() >> 3, to.z() >> 3) < 0)
                grows[k] = static_cast<std::uint8_t>(grows[k] | 1u << f);
        }
    });
    std::vector<openvdb::Coord> missing;
    for (std::size_t k = 0; k < grows.size(); ++k)
        for (std::size_t f = 0; grows[k] != 0 && f < 6; ++f)
            if (grows[k] >> f & 1) missing.push_back(beside(band.awake[k], f));
    for (const LeafVoxels& on_side : carried) {
        const openvdb::Coord& o = on_side.origin;
        if (band.table.find(o.x() >> 3, o.y() >> 3, o.z() >> 3) < 0) missing.push_back(o);
    }
    if (missing.empty()) return;
    for (const openvdb::Coord& origin : missing) grid.tree().touchLeaf(origin);

    const Band before = std::exchange(band, Band());
    std::vector<std::uint8_t> awake(before.leaves.size(), 0);
    for (const std::uint32_t n : before.awake) awake[n] = 1;
    grid.tree().getNodes(band.leaves);
    band.table = surface::LeafTable(band.leaves);
    band.print.assign(band.leaves.size(), 0);
    band.made.assign(band.leaves.size(), 0);
    if (!before.held.empty()) band.held.resize(band.leaves.size());
    for (std::uint32_t n = 0; n < band.leaves.size(); ++n) {
        const openvdb::Coord o = band.leaves[n]->origin();
        const std::int32_t old = before.table.find(o.x() >> 3, o.y() >> 3, o.z() >> 3);
        if (old < 0 || awake[static_cast<std::size_t>(old)]) band.awake.push_back(n);
        if (old < 0)
            band.made[n] = 1;
        else
            band.print[n] = before.print[static_cast<std::size_t>(old)];
        if (old >= 0 && !before.held.empty()) band.held[n] = before.held[static_cast<std::size_t>(old)];
    }
}

bool has_distance(const Leaf& leaf, float background) {
    const float* v = leaf.buffer().data();
    return std::any_of(v, v + Leaf::SIZE, [&](float value) { return !(std::abs(value) >= background); });
}

// The active nodes of a new leaf that lie inside, by the signs of their neighbours in leaves of the old band.
Nodes nodes_inside(const Leaf& leaf, const Band& band, float background, const Domain& domain) {
    const openvdb::Coord origin = leaf.origin();
    const bool inner =
        domain.owns(origin.x() - 1, origin.y() - 1) && domain.owns(origin.x() + 8, origin.y() + 8);
    const auto within = [](int n) { return n > 0 && n < 7; };
    Nodes inside;
    for (auto it = leaf.cbeginValueOn(); it; ++it) {
        const openvdb::Coord local = Leaf::offsetToLocalCoord(it.pos());
        if (inner && within(local.x()) && within(local.y()) && within(local.z())) continue;
        float side = 0.0f;
        for (int k = 0; k < 6; ++k) {
            openvdb::Coord q = origin + local;
            q[k / 2] += k % 2 ? 1 : -1;
            if (!inner) q.reset(domain.source_node(0, q.x()), domain.source_node(1, q.y()), q.z());
            if ((q & ~7) == origin) continue;
            const std::int32_t other = band.table.find(q.x() >> 3, q.y() >> 3, q.z() >> 3);
            if (other < 0) continue;
            const float v = band.leaves[static_cast<std::size_t>(other)]->getValue(q);
            if (std::abs(v) < background) side = v;
        }
        inside.set(it.pos(), std::signbit(side));
    }
    return inside;
}

}  // namespace

Band::Band(std::vector<Leaf*> all, surface::LeafTable of_all, const Domain& domain,
           std::span<const std::uint8_t> changed)
    : leaves(std::move(all)), table(std::move(of_all)) {
    print.resize(leaves.size());
    made.resize(leaves.size(), 0);
    std::vector<std::uint8_t> moved(leaves.size());
    surface::parallel_each(leaves.size(), kLeavesOfTask / 2, [&](std::size_t n) {
        const bool known = !changed.empty() && changed[n] != 0;
        print[n] = known ? 0 : fingerprint(*leaves[n]);
        moved[n] = known || print[n] != leaves[n]->transientData();
    });
    const std::vector<std::uint8_t> near = with_readers(*this, domain, moved);
    for (std::uint32_t n = 0; n < leaves.size(); ++n)
        if (near[n]) awake.push_back(n);
}

std::vector<std::uint8_t> with_readers(const Band& band, const Domain& domain,
                                       const std::vector<std::uint8_t>& marked) {
    std::vector<std::uint8_t> result(marked.size(), 0);
    surface::parallel_each(marked.size(), kLeavesOfTask / 2, [&](std::size_t n) {
        if (marked[n])
            each_around(band.table, domain, band.leaves[n]->origin(), [&](std::size_t k) {
                std::atomic_ref(result[k]).store(1, std::memory_order_relaxed);
            });
    });
    return result;
}

std::uint32_t fingerprint(const Leaf& leaf) {
    // Independent sums, so that the loop vectorises, with the odd multiplier of Knuth's multiplicative hash.
    constexpr std::size_t kSums = 32;
    constexpr std::uint32_t kOdd = 2654435761u;
    std::array<std::uint32_t, kSums> sum{};
    const float* value = leaf.buffer().data();
    for (std::size_t n = 0; n < Leaf::SIZE; n += kSums) {
        std::array<std::uint32_t, kSums> bits;
        std::memcpy(bits.data(), value + n, sizeof bits);
        for (std::size_t k = 0; k < kSums; ++k) sum[k] = (sum[k] ^ bits[k]) * kOdd + (sum[k] >> 15);
    }
    std::uint32_t hash = 0;
    const auto add = [&](std::uint32_t word) { hash = (std::rotl(hash, 5) ^ word) * kOdd; };
    for (const std::uint32_t word : sum) add(word);
    for (const std::uint64_t word : mask_of(leaf)) {
        add(static_cast<std::uint32_t>(word));
        add(static_cast<std::uint32_t>(word >> 32));
    }
    return hash | 1;
}

void grow(Band& band, Grid& grid, const Domain& domain) {
    const std::vector<LeafVoxels> carried = across_sides(band, domain);
    make_leaves(band, grid, domain, carried);
    std::vector<Mask> before(band.leaves.size());
    surface::parallel_each(before.size(), kLeavesOfTask,
                           [&](std::size_t n) { before[n] = mask_of(*band.leaves[n]); });
    surface::parallel_each(band.awake.size(), kLeavesOfTask, [&](std::size_t k) {
        const std::size_t n = band.awake[k];
        Leaf& leaf = *band.leaves[n];
        const openvdb::Coord o = leaf.origin();
        std::array<const Mask*, 6> around{};
        for (std::size_t f = 0; f < 6; ++f) {
            const std::int32_t next = band.table.find(
                (o.x() >> 3) + kFaces[f][0], (o.y() >> 3) + kFaces[f][1], (o.z() >> 3) + kFaces[f][2]);
            if (next >= 0) around[f] = &before[static_cast<std::size_t>(next)];
        }
        const Mask mask = grown(before[n], around);
        auto active = leaf.getValueMask();
        for (openvdb::Index x = 0; x < 8; ++x)
            active.getWord<std::uint64_t>(x) = mask[x] & own_voxels(domain, o, static_cast<int>(x));
        leaf.setValueMask(active);
    });
    for (const auto& [o, mask] : carried) {
        Leaf& leaf =
            *band.leaves[static_cast<std::size_t>(band.table.find(o.x() >> 3, o.y() >> 3, o.z() >> 3))];
        Nodes active = leaf.getValueMask();
        for (openvdb::Index x = 0; x < 8; ++x) active.getWord<std::uint64_t>(x) |= mask[x];
        leaf.setValueMask(active);
    }
}

void sign_new_leaves(const Band& band, const Grid& grid, const Domain& domain) {
    const float background = grid.background();
    std::vector<std::uint8_t> is_new(band.leaves.size(), 0);
    surface::parallel_each(band.awake.size(), 128, [&](std::size_t k) {
        const std::size_t n = band.awake[k];
        is_new[n] = band.made[n] || !has_distance(*band.leaves[n], background);
    });
    std::vector<Leaf*> leaves;
    for (std::size_t n = 0; n < is_new.size(); ++n)
        if (is_new[n]) leaves.push_back(band.leaves[n]);
    // All leaves are read before any is written: only voxels of the old band give their sign, whatever the
    // order of the leaves.
    std::vector<Nodes> inside(leaves.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(),
                      [&](std::size_t k) { inside[k] = nodes_inside(*leaves[k], band, background, domain); });
    const openvdb::tools::SignedFloodFillOp<Grid::TreeType> flood(grid.tree());
    // Just below the background, so that the flood fill takes these signs as known.
    const float known = std::nextafter(background, 0.0f);
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t k) {
        for (auto it = leaves[k]->beginValueOn(); it; ++it)
            it.setValue(inside[k].isOn(it.pos()) ? -known : known);
        if (!leaves[k]->isEmpty()) flood(*leaves[k]);
    });
}

}  // namespace sidewall::levelset
