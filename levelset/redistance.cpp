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

// The band's nodes in a row of eight: those next to the front, and the others.
struct Lanes {
    LaneMask front, other;
};

// Divides a row's active nodes into those next to the front (on it or with a neighbour on its other side) and
// the others. \returns whether there are any of the first, and of the second.
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

// Nodes next to the front are rescaled only where |grad phi| differs from 1 by more than this: to correct
// smaller deviations at every time step would move the front by the errors of the differences. With 0.06
// distances are off by more than redistance_test.cpp allows.
constexpr float kTolerance = 0.02f;

// The largest factor that rescaling applies: a node midway between two fronts has next to no slope.
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
            // Across the front the distances of two neighbours add up to a cell at most.
            crossed = std::max(crossed, a > distance ? a : 0.0f);
            crossed = std::max(crossed, b > distance ? b : 0.0f);
        }
        const float most = std::max(std::sqrt(steep), crossed), least = std::sqrt(flat);
        const float shrink = (1.0f + kTolerance) / std::max(most, 1.0f);
        const float grow = std::min(kMostGrowth, (1.0f - kTolerance) / std::max(least, kFlattest));
        out[z] = value * (most > 1.0f + kTolerance ? shrink : least < 1.0f - kTolerance ? grow : 1.0f);
    }
}

// Closes gaps of no width, where two fronts have met on a node: solid on both sides along an axis and no gas
// beside it.
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

// Resets nodes to the background if their distance is from a wall or gap that holds no node: |phi| rises by
// about a cell (kRise) to both sides along an axis, and no neighbour lies across the front.
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

// Largest change of phi, in dx, from the neighbour to the node behind it with which the second-order
// difference is used. Along an axis a distance changes by 1 at most; the rest allows for values that earlier
// sweeps have not corrected yet.
constexpr float kSteepest = 1.5f;

// A node nearer to the front than this, in cells, may lie beside a wall that rounding has moved.
constexpr float kBesideFront = 0.01f;

// The signed distances of two neighbours across a front differ by a cell if their axis meets it at a right
// angle. Where they differ by less than this, in cells, the front may bend to a wall beside them.
constexpr float kAcross = 0.95f;

// Arrival of an axis that does not take part: farther than any band, small enough to be squared.
constexpr float kUnknown = 1e6f;

// Signed distances of a row's nodes from their upwind neighbours: solves sum_k (w_k (u - a_k))^2 = 1 over the
// axes k whose arrival a_k is below u (Rouy and Tourin upwinding); arrivals are added in ascending order.
// Differences are of second order if the node behind the neighbour is nearer still to the front, else
// (unknown or past a ridge) of first order. With \p kinks, second differences are limited to twice those on
// the node's far side, as van Leer limits slopes (J. Comput. Phys. 32 (1979) 101): where phi bends less
// there, the front has a kink between.
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
                // A distance rises by a cell at most along an axis: a larger value of the next node has not
                // been solved yet.
                const float bend = own - 2.0f * near + far,
                            beyond = std::min(next, own + 1.0f) - 2.0f * own + near;
                // Share of the second difference: the limited one if the next node is known or the far node
                // lies across the front beside a wall; else 1, or 0 if the far node is on the front, maybe at
                // the edge of another body. Bends by rounding count in full. No branches, so that eight nodes
                // are solved at once.
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
        // Relative to the first arrival, for precision.
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
        // At most a cell beyond the nearest neighbour: an extrapolation over a kink could give more.
        out[z] = std::copysign(std::min(background, dx * std::min(a[0] + u, nearest + 1.0f)), side);
    }
}

// Nodes with a second difference of phi above kSharpBend along an axis: an edge of the front may be near.
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

// Corrects the values of selected nodes by their distances from edges of the front. An old value between the
// edge's distance and that by differences along the axes stays: a front that moves evenly leaves exact ones.
// \param known  whether the other old values were distances, too: then each goes to the nearer of the two. If
// not, those inside the material take the edge's, or the larger at a hollow edge if they exceed both.
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

// A leaf's new values from the old ones in \p block (load_axes). Nodes next to the front change only if
// \p rescale.
// \param whole  returns the block with all of its values (load_block).
// \param known  see add_edges.
template <class Whole>
void sweep(const Leaf& leaf, const B& block, Whole&& whole, float dx, float background, bool rescale,
           Start start, bool known, const Nodes* held, float* out) {
    const float inv_dx = 1.0f / dx;
    // With Start::function values near 0 mean no more than their sign, and there are no edges to keep.
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

// Deactivates nodes whose values have reached the background.
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

// Whether no value is NaN or beyond the background, which nodes off the band hold.
bool all_finite(const float* v, float background) {
    int within = 1;
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) within &= std::abs(v[n]) <= background;
    return within != 0;
}

}  // namespace

void redistance(Grid& grid, const Domain& domain, int sweeps, Start start) {
    // Marks of rest are for kSweepsAfterTimeStep sweeps; more read farther. Copied grids have old marks.
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
    // Jacobi sweeps: a leaf reads its neighbours' values of the sweep before, so that the order of leaves
    // cannot matter. Sweeps alternate between two buffers, and the last one writes to the leaves.
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
    // Leaves that read a removed one are not at rest. Removed ones that grow() made do not count: they were
    // missing before, too.
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
