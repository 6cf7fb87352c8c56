#include "levelset/redistance.hpp"

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <utility>

#include "levelset/band.hpp"
#include "levelset/block.hpp"
#include "levelset/large_vector.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/row.hpp"
#include "surface/error.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

using B = Block<2>;

bool has_distance(const Leaf& leaf, float background) {
    const float* v = leaf.buffer().data();
    return std::any_of(v, v + Leaf::SIZE, [&](float value) { return !(std::abs(value) >= background); });
}

// The active nodes of a new leaf that lie inside, by their neighbours of the old band in other leaves.
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

// Leaves that growing the band made hold the value of the tile they replace, whose sign means nothing: gives
// their voxels the side of their neighbours.
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
    // All are read before any is written: a voxel just reached has a neighbour of the old band, and another
    // new leaf's is to count for nothing whichever comes first.
    std::vector<Nodes> inside(leaves.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(),
                      [&](std::size_t k) { inside[k] = nodes_inside(*leaves[k], band, background, domain); });
    const openvdb::tools::SignedFloodFillOp<Grid::TreeType> flood(grid.tree());
    // Just inside the background, so that the flood takes it for known.
    const float known = std::nextafter(background, 0.0f);
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t k) {
        for (auto it = leaves[k]->beginValueOn(); it; ++it)
            it.setValue(inside[k].isOn(it.pos()) ? -known : known);
        if (!leaves[k]->isEmpty()) flood(*leaves[k]);
    });
}

// The band's nodes among the eight of a row: those next to the front, and the others.
struct Lanes {
    LaneMask front, other;
};

// Divides a row's active nodes by whether they have a neighbour on the other side of the front.
// \returns whether there are any that have, and any others.
std::pair<bool, bool> divide_row(const float* v, const LaneMask& active, Lanes& lanes) {
    std::int32_t any_front = 0, any_other = 0;
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        const std::int32_t inside = v[n] < 0.0f;
        std::int32_t front = 0;
        for (const int stride : B::kStride)
            front |= ((v[n - stride] < 0.0f) ^ inside) | ((v[n + stride] < 0.0f) ^ inside);
        lanes.front[z] = active[z] & -front;
        lanes.other[z] = active[z] & ~-front;
        any_front |= lanes.front[z];
        any_other |= lanes.other[z];
    }
    return {any_front != 0, any_other != 0};
}

// Slopes of nodes next to the front are left as they are within this of |grad phi| = 1: to correct less at
// every time step would move the front by the differences' own errors. With 0.06 distances are off by more
// than redistance_test.cpp allows.
constexpr float kTolerance = 0.02f;

// A node at rest between two fronts has next to no slope; a sweep multiplies its value by no more than this.
constexpr float kMostGrowth = 2.0f;
// Keeps the quotient finite: any slope below 1 / kMostGrowth gives the same growth.
constexpr float kFlattest = 0.1f;

// Values of nodes next to the front, scaled so that |grad phi| = 1. Slopes count as too flat or too steep
// only if both one-sided differences say so: at kinks and in curved regions they disagree, and a factor
// applied there again and again would move the front.
void rescale_row(const float* v, float inv_dx, Row& out) {
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        const float value = v[n], distance = std::abs(value) * inv_dx;
        float steep = 0.0f, flat = 0.0f, crossed = 0.0f;
        for (const int stride : B::kStride) {
            const float a = std::abs(value - v[n - stride]) * inv_dx,
                        b = std::abs(v[n + stride] - value) * inv_dx;
            const float low = std::min(a, b), high = std::max(a, b);
            steep += low * low;
            flat += high * high;
            // An edge that the front crosses is longer than the distances of both its ends together.
            crossed = std::max(crossed, a > distance ? a : 0.0f);
            crossed = std::max(crossed, b > distance ? b : 0.0f);
        }
        const float most = std::max(std::sqrt(steep), crossed), least = std::sqrt(flat);
        const float shrink = (1.0f + kTolerance) / std::max(most, 1.0f);
        const float grow = std::min(kMostGrowth, (1.0f - kTolerance) / std::max(least, kFlattest));
        out[z] = value * (most > 1.0f + kTolerance ? shrink : least < 1.0f - kTolerance ? grow : 1.0f);
    }
}

// The second-order difference takes part unless phi changes by more than this (in dx) from the neighbour to
// the node behind it: along an axis a distance changes by 1 at most, and half as much again is left for
// values that earlier sweeps have not corrected yet.
constexpr float kSteepest = 1.5f;

// Stands for an arrival that does not take part: farther than any band, small enough for its square.
constexpr float kUnknown = 1e6f;

// Signed distance that the upwind neighbours of each node imply: solves
// sum_k (w_k (u - a_k))^2 = 1 for u above the a_k that take part (Rouy and Tourin upwinding); the smallest
// arrive first and a later one only counts where it would be passed. Second order where the next node still
// descends, first order where it is unknown or past a ridge.
void solve_row(const float* v, float inv_dx, float dx, float background, Row& out) {
    const float half_width = background * inv_dx;
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        const float side = v[n] < 0.0f ? -inv_dx : inv_dx;
        float a[3], w[3];  // arrival and squared weight, by axis
        float nearest = half_width;
        for (int axis = 0; axis < 3; ++axis) {
            const int stride = B::kStride[axis];
            const float minus = side * v[n - stride], plus = side * v[n + stride];
            const float near = std::min(minus, plus);
            const float far = minus < plus ? side * v[n - 2 * stride] : side * v[n + 2 * stride];
            const bool second = (far < near) & (far > near - kSteepest);
            nearest = std::min(nearest, near);
            a[axis] = second ? (4.0f * near - far) * (1.0f / 3.0f) : near;
            a[axis] = near >= half_width ? kUnknown : a[axis];
            w[axis] = second ? 2.25f : 1.0f;  // (3/2)^2: (3 u - 4 near + far) / 2
        }
        const auto order = [&](int i, int j) {
            const bool swap = a[j] < a[i];
            const float ai = swap ? a[j] : a[i], aj = swap ? a[i] : a[j];
            const float wi = swap ? w[j] : w[i], wj = swap ? w[i] : w[j];
            a[i] = ai, a[j] = aj, w[i] = wi, w[j] = wj;
        };
        order(0, 1);
        order(1, 2);
        order(0, 1);
        // Relative to the first arrival, which keeps the digits.
        const float b1 = a[1] - a[0], b2 = a[2] - a[0];
        float u = 1.0f / std::sqrt(w[0]);
        float sw = w[0] + w[1], swb = w[1] * b1, swbb = w[1] * b1 * b1;
        float discriminant = swb * swb - sw * (swbb - 1.0f);
        const bool two = (u > b1) & (discriminant >= 0.0f);
        u = two ? (swb + std::sqrt(std::max(discriminant, 0.0f))) / sw : u;
        sw += w[2], swb += w[2] * b2, swbb += w[2] * b2 * b2;
        discriminant = swb * swb - sw * (swbb - 1.0f);
        const bool three = two & (u > b2) & (discriminant >= 0.0f);
        u = three ? (swb + std::sqrt(std::max(discriminant, 0.0f))) / sw : u;
        // No farther than a cell beyond the nearest neighbour: an extrapolation over a kink could be.
        out[z] = std::copysign(std::min(background, dx * std::min(a[0] + u, nearest + 1.0f)), side);
    }
}

// One leaf's new values from the old ones in \p block; those next to the front change if \p rescale.
void sweep(const Leaf& leaf, const B& block, float dx, float background, bool rescale, float* out) {
    const float inv_dx = 1.0f / dx;
    Lanes lanes;
    Row values;
    for (int row = 0; row < 64; ++row) {
        const auto active = leaf.getValueMask().getWord<openvdb::Byte>(static_cast<openvdb::Index>(row));
        if (active == 0) continue;
        const float* v = &block.value[static_cast<std::size_t>(B::at(row >> 3, row & 7, 0))];
        const auto [front, other] = divide_row(v, kLaneMasks[active], lanes);
        if (front && rescale) {
            rescale_row(v, inv_dx, values);
            blend(values, lanes.front, out + 8 * row);
        }
        if (!other) continue;
        solve_row(v, inv_dx, dx, background, values);
        blend(values, lanes.other, out + 8 * row);
    }
}

// Nodes that have come to the background leave the band.
void drop_far(Leaf& leaf, const float* values, float background) {
    Nodes active = leaf.getValueMask();
    for (openvdb::Index row = 0; row < 64; ++row) {
        auto& bits = active.getWord<openvdb::Byte>(row);
        if (bits == 0) continue;
        const float* v = values + 8 * row;
        std::int32_t near = 0;
        for (int z = 0; z < kLanes; ++z)
            near |= static_cast<std::int32_t>(!(std::abs(v[z]) >= background)) << z;
        bits = static_cast<openvdb::Byte>(bits & near);
    }
    leaf.setValueMask(active);
}

// Off the band values are the background.
bool all_finite(const float* v, float background) {
    int within = 1;
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) within &= std::abs(v[n]) <= background;
    return within != 0;
}

}  // namespace

void redistance(Grid& grid, const Domain& domain, int sweeps) {
    // More sweeps read farther than rest was found for, and copies bring theirs from elsewhere.
    if (sweeps != kSweepsAfterTimeStep)
        for (auto leaf = grid.tree().beginLeaf(); leaf; ++leaf) leaf->setTransientData(0);
    std::vector<Leaf*> leaves;
    grid.tree().getNodes(leaves);
    Band band(leaves, surface::LeafTable(leaves), domain, {});
    redistance(band, grid, domain, sweeps);
}

void redistance(Band& band, Grid& grid, const Domain& domain, int sweeps) {
    const float background = grid.background(), dx = static_cast<float>(domain.spacing);
    grow(band, grid, domain);
    if (band.leaves.empty())
        throw NumericsError(
            "the surface has vanished: no material boundary is left in the domain; shorten the step");
    sign_new_leaves(band, grid, domain);
    std::atomic<bool> finite{true};
    const std::size_t count = band.awake.size();
    LargeVector<float> swept(count * Leaf::SIZE);
    const auto each = [&](auto&& use) {
        surface::parallel_each(count, 4, [&](std::size_t k) {
            use(k, std::size_t{band.awake[k]}, *band.leaves[band.awake[k]]);
        });
    };
    // Every leaf reads its neighbours as they were before the sweep, so that the order of leaves cannot
    // matter: sweeps go to and fro between two places, and the last one ends in the leaves.
    LeafData now(band.table, band.leaves);
    const auto place = [&](std::size_t k, bool in_leaf) {
        return in_leaf ? band.leaves[band.awake[k]]->buffer().data() : &swept[k * Leaf::SIZE];
    };
    const auto move_to = [&](bool in_leaf) {
        for (std::size_t k = 0; k < count; ++k) now.values[band.awake[k]] = place(k, in_leaf);
    };
    if (sweeps % 2 != 0) {
        each([&](std::size_t k, std::size_t n, const Leaf&) {
            std::copy_n(now.values[n], Leaf::SIZE, place(k, false));
        });
        move_to(false);
    }
    std::vector<std::uint8_t> empty(band.leaves.size(), 0);
    for (int left = sweeps; left > 0; --left) {
        const bool to_leaf = left % 2 != 0;
        each([&](std::size_t k, std::size_t n, Leaf& leaf) {
            const float* in = now.values[n];
            float* out = place(k, to_leaf);
            if (!all_finite(in, background)) finite = false;
            B block;
            load_axes(now, domain, leaf, background, block);
            std::copy_n(in, Leaf::SIZE, out);
            sweep(leaf, block, dx, background, left == sweeps, out);
            if (left > 1) return;
            drop_far(leaf, out, background);
            empty[n] = leaf.isEmpty();
            leaf.setTransientData(band.print[n] != 0 && fingerprint(leaf) == band.print[n] ? band.print[n]
                                                                                           : 0);
        });
        if (!finite)
            throw NumericsError(
                "a level set value is not finite: a speed or a flux was; check the recipe's rates");
        move_to(to_leaf);
    }
    // What a leaf that goes was, those around it have read; leaves that the band only grew into for a moment
    // have been empty before.
    std::vector<std::uint8_t> gone(empty.size());
    for (std::size_t n = 0; n < gone.size(); ++n) gone[n] = empty[n] && !band.made[n];
    if (std::find(gone.begin(), gone.end(), 1) != gone.end()) {
        const std::vector<std::uint8_t> readers = with_readers(band, domain, gone);
        for (std::size_t n = 0; n < readers.size(); ++n)
            if (readers[n]) band.leaves[n]->setTransientData(0);
    }
    for (std::size_t n = 0; n < empty.size(); ++n)
        if (empty[n]) grid.tree().addTile(1, band.leaves[n]->origin(), background, false);
}

}  // namespace sidewall::levelset
