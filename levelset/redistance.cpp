#include "levelset/redistance.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <utility>

#include "levelset/band.hpp"
#include "levelset/block.hpp"
#include "levelset/edge_distance.hpp"
#include "levelset/large_vector.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/rounding.hpp"
#include "levelset/row.hpp"
#include "surface/error.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

using B = Block<2>;

// The band's nodes among the eight of a row: those next to the front, and the others.
struct Lanes {
    LaneMask front, other;
};

// Divides a row's active nodes by whether they have a neighbour on the other side of the front.
// \returns whether there are any that have, and any others.
std::pair<bool, bool> divide_row(const float* v, float on_front, const LaneMask& active, Lanes& lanes) {
    std::int32_t any_front = 0, any_other = 0;
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        const std::int32_t in = v[n]<-on_front, out = v[n]> on_front;
        std::int32_t front = (in | out) ^ 1;  // nodes on the front
        for (const int stride : B::kStride) {
            const float a = v[n - stride], b = v[n + stride];
            front |= (in & ((a >= on_front) | (b >= on_front))) | (out & ((a < -on_front) | (b < -on_front)));
        }
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

// Closes gaps without width, where two fronts have met on nodes: solid on both sides along an axis and no gas
// beside them.
void close_gaps_row(const float* v, float on_front, Row& values) {
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        bool between = false, gas = false;
        for (const int stride : B::kStride) {
            between |= (v[n - stride] < -on_front) & (v[n + stride] < -on_front);
            gas |= (v[n - stride] > on_front) | (v[n + stride] > on_front);
        }
        const bool closes = (std::abs(v[n]) <= on_front) & between & !gas;
        values[z] = closes ? -2.0f * on_front : values[z];
    }
}

// Forgets distances from walls and gaps that no node is in: from them |phi| rises by a cell to both sides
// along an axis.
void forget_hidden_row(const float* v, float dx, float on_front, float background, Row& values) {
    constexpr float kRise = 0.9f;
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        const float side = v[n] < -on_front ? -1.0f : 1.0f, risen = side * v[n] + kRise * dx;
        bool between = false, crossed = false;
        for (const int stride : B::kStride) {
            const float a = side * v[n - stride], b = side * v[n + stride];
            between |= (a > risen) & (b > risen);
            crossed |= (a < -on_front) | (b < -on_front);
        }
        values[z] = between & !crossed ? side * background : values[z];
    }
}

// The second-order difference takes part unless phi changes by more than this (in dx) from the neighbour to
// the node behind it: along an axis a distance changes by 1 at most, and half as much again is left for
// values that earlier sweeps have not corrected yet.
constexpr float kSteepest = 1.5f;

// A node nearer to the front than this, in cells, may stand beside a wall that has moved by rounding.
constexpr float kBesideFront = 0.01f;

// Two neighbours on either side of a front that their axis meets at a right angle are a cell apart in
// distance. Where they are nearer than this, in cells, the front may bend to a wall beside them.
constexpr float kAcross = 0.95f;

// Stands for an arrival that does not take part: farther than any band, small enough for its square.
constexpr float kUnknown = 1e6f;

// Signed distance that the upwind neighbours of each node imply: solves
// sum_k (w_k (u - a_k))^2 = 1 for u above the a_k that take part (Rouy and Tourin upwinding); the smallest
// arrive first and a later one only counts where it would be passed. Second order where the next node still
// descends, first order where it is unknown or past a ridge. In between, where phi bends less on the node's
// far side than on its near one: there is a kink of the front between, and the bend is limited by twice the
// smaller one, as slopes are by van Leer, J. Comput. Phys. 32 (1979) 101.
//
// \param kinks  whether values are distances beside kinks, and nodes within kOnFront lie on the front.
template <bool kinks>
void solve_row(const float* v, float inv_dx, float dx, float background, Row& out) {
    const float half_width = background * inv_dx;
    const float on_front = kinks ? static_cast<float>(kOnFront) * dx : 0.0f;
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        const float side = v[n] < -on_front ? -inv_dx : inv_dx;
        const float own = side * v[n];
        float a[3], w[3];  // arrival and squared weight, by axis
        float nearest = half_width;
        for (int axis = 0; axis < 3; ++axis) {
            const int stride = B::kStride[axis];
            const float minus = side * v[n - stride], plus = side * v[n + stride];
            const float near = std::min(minus, plus), next = std::max(minus, plus);
            const float far = minus < plus ? side * v[n - 2 * stride] : side * v[n + 2 * stride];
            const bool second = (far < near - kTie) & (far > near - kSteepest);
            nearest = std::min(nearest, near);
            float weight = second ? 1.5f : 1.0f;  // (3 u - 4 near + far) / 2
            float arrival = second ? (4.0f * near - far) * (1.0f / 3.0f) : near;
            if constexpr (kinks) {
                // Along an axis a distance rises by a cell at most: a next node that lies farther off has not
                // been solved yet.
                const float bend = own - 2.0f * near + far,
                            beyond = std::min(next, own + 1.0f) - 2.0f * own + near;
                // Share of the second-order difference. Where the next node is not known yet, a far one on
                // the front may be the edge of another body, and one across it may lie beside a wall. Bends
                // that rounding makes are none. Without a branch, so that eight nodes are solved at once.
                const float rounding = std::abs(bend) < 1e-3f ? 1.0f : 0.0f;
                const float known = std::abs(far) < kBesideFront ? 0.0f : 1.0f;
                const float ratio = 2.0f * beyond / (bend + rounding);
                const float limited = 0.5f * (1.0f + std::abs(ratio) - std::abs(ratio - 1.0f));  // 0 to 1
                const bool open = next >= half_width - kTie,
                           at_wall = (far < -kBesideFront) & (near - far < kAcross);
                const float share = std::max(rounding, open & !at_wall ? known : limited);
                const float half = second ? 0.5f * share : 0.0f;
                // u - near + half (u - 2 near + far), over its weight
                weight = 1.0f + half;
                arrival = (near + half * (2.0f * near - far)) / weight;
            }
            a[axis] = near >= half_width - kTie ? kUnknown : arrival;
            w[axis] = weight * weight;
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

// Nodes at which phi bends along an axis by more than kSharpBend. They may lie near an edge of the front.
LaneMask bent(const float* v, float inv_dx, const Row& solved, const LaneMask& where) {
    LaneMask result;
    for (std::size_t z = 0; z < kLanes; ++z) {
        const auto n = static_cast<std::ptrdiff_t>(z);
        const float own = solved[z];
        float most = 0.0f;
        for (const int stride : B::kStride) {
            const float minus = v[n - stride], plus = v[n + stride];
            const bool low = std::abs(minus) < std::abs(plus);
            const float near = low ? minus : plus, next = low ? plus : minus,
                        far = low ? v[n - 2 * stride] : v[n + 2 * stride];
            most = std::max({most, std::abs(own - 2.0f * near + far), std::abs(near - 2.0f * own + next)});
        }
        result[z] = where[z] & -static_cast<std::int32_t>(most * inv_dx > kSharpBend);
    }
    return result;
}

bool any(const LaneMask& mask) {
    std::int32_t bits = 0;
    for (const std::int32_t lane : mask) bits |= lane;
    return bits != 0;
}

// Distances of the selected nodes from edges of the front, written over those by differences along the axes.
// Values between the two stay as they were: a front that moves by the same everywhere leaves exact
// ones.
// \param known  whether others were distances, too, and go to the nearer end. If not, those inside the
// material take the edge's, or before a hollow edge, where they are larger than both, the larger.
void add_edges(const float* v, float inv_dx, float dx, float background, const LaneMask& where, bool known,
               Row& values) {
    const float half_width = background * inv_dx;
    for (std::size_t z = 0; z < kLanes; ++z) {
        if (where[z] == 0) continue;
        const float side = std::signbit(values[z]) ? -inv_dx : inv_dx;
        const float along = side * values[z], own = side * v[z];
        const auto [edge, convex] = edge_distance(v + z, along, side, half_width);
        const float between = std::clamp(own, std::min(edge, along), std::max(edge, along));
        const bool anew = !known && side < 0.0f && own != between;
        const float u = !anew ? between : convex ? edge : std::max(edge, between);
        values[z] = std::copysign(std::min(background, dx * u), values[z]);
    }
}

// One leaf's new values from the old ones in \p block, along the axes from its nodes; those next to the front
// change if \p rescale.
// \param whole  gives the block with all of its values.
// \param known  see add_edges.
template <class Whole>
void sweep(const Leaf& leaf, const B& block, Whole&& whole, float dx, float background, bool rescale,
           Start start, bool known, const Nodes* held, float* out) {
    const float inv_dx = 1.0f / dx;
    // Any function has no nodes on the front that mean more than their sign, and no edges to keep.
    const float on_front = start == Start::distance ? static_cast<float>(kOnFront) * dx : 0.0f;
    Lanes lanes;
    Row values;
    for (int row = 0; row < 64; ++row) {
        const auto at = static_cast<openvdb::Index>(row);
        auto active = leaf.getValueMask().getWord<openvdb::Byte>(at);
        if (held) active = static_cast<openvdb::Byte>(active & ~held->getWord<openvdb::Byte>(at));
        if (active == 0) continue;
        const float* v = &block.value[static_cast<std::size_t>(B::at(row >> 3, row & 7, 0))];
        const auto [front, other] = divide_row(v, on_front, kLaneMasks[active], lanes);
        if (front && rescale) {
            rescale_row(v, inv_dx, values);
            if (start == Start::distance) {
                close_gaps_row(v, on_front, values);
                forget_hidden_row(v, dx, on_front, background, values);
            }
            blend(values, lanes.front, out + 8 * row);
        }
        if (!other) continue;
        if (start == Start::distance) {
            solve_row<true>(v, inv_dx, dx, background, values);
            const LaneMask edges = bent(v, inv_dx, values, lanes.other);
            if (any(edges))
                add_edges(whole().value.data() + (v - block.value.data()), inv_dx, dx, background, edges,
                          known, values);
            if (rescale) forget_hidden_row(v, dx, on_front, background, values);
        } else {
            solve_row<false>(v, inv_dx, dx, background, values);
        }
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

void redistance(Grid& grid, const Domain& domain, int sweeps, Start start) {
    // More sweeps read farther than rest was found for, and copies bring theirs from elsewhere.
    if (sweeps != kSweepsAfterTimeStep)
        for (auto leaf = grid.tree().beginLeaf(); leaf; ++leaf) leaf->setTransientData(0);
    std::vector<Leaf*> leaves;
    grid.tree().getNodes(leaves);
    Band band(leaves, surface::LeafTable(leaves), domain, {});
    redistance(band, grid, domain, sweeps, start);
}

void redistance(Band& band, Grid& grid, const Domain& domain, int sweeps, Start start) {
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
            std::optional<B> all;
            const auto whole = [&]() -> const B& {
                if (!all) load_block(now, domain, leaf, background, all.emplace());
                return *all;
            };
            std::copy_n(in, Leaf::SIZE, out);
            sweep(leaf, block, whole, dx, background, left == sweeps, start, sweeps == kSweepsAfterTimeStep,
                  band.held.empty() ? nullptr : &band.held[n], out);
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
