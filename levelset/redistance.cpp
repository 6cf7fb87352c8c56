#include "levelset/redistance.hpp"

#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <cmath>
#include <vector>

#include "levelset/block.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

using LeafManager = openvdb::tree::LeafManager<Grid::TreeType>;
using B = Block<2>;

// Runs op(block, leaf, out) on every leaf in parallel, then makes the outputs the grid's values: every leaf
// reads its neighbours as they were before, so that the order of leaves cannot matter. The manager brings one
// spare buffer a leaf.
template <class Op>
void for_each_block(LeafManager& leaves, const Grid& grid, const Domain& domain, Op&& op) {
    const float background = grid.background();
    tbb::parallel_for(leaves.leafRange(4), [&](const LeafManager::LeafRange& range) {
        const auto accessor = grid.getConstUnsafeAccessor();
        auto block = std::make_unique<B>();
        for (auto leaf = range.begin(); leaf; ++leaf) {
            load_block(accessor, domain, *leaf, background, *block);
            op(*block, *leaf, leaf.buffer(1).data());
        }
    });
    leaves.swapLeafBuffer(1);
}

// Activates the face neighbours of the band, across a periodic side too.
void grow_band(Grid& grid, const Domain& domain) {
    auto& tree = grid.tree();
    openvdb::tools::dilateActiveValues(tree, 1, openvdb::tools::NN_FACE, openvdb::tools::IGNORE_TILES);
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (domain.side[a] != Side::periodic) continue;
        std::vector<openvdb::Coord> wrapped;
        for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
            const int low = leaf->origin()[axis], last = domain.last_node(axis);
            if (low > 0 && low + 7 < last) continue;
            for (auto it = leaf->cbeginValueOn(); it; ++it) {
                const openvdb::Coord c = it.getCoord();
                if (c[axis] == -1 || c[axis] == last + 1) {
                    openvdb::Coord w = c;
                    w[axis] = domain.source_node(axis, c[axis]);
                    wrapped.push_back(w);
                }
            }
        }
        auto accessor = grid.getAccessor();
        for (const auto& c : wrapped) {
            const float value =
                accessor.getValue(c);  // a copy: making a leaf overwrites the tile it comes from
            accessor.setValueOn(c, value);
        }
    }
    // Off the domain nothing is active; nodes there would otherwise grow sideways for ever.
    for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
        const openvdb::Coord o = leaf->origin();
        if (domain.owns(o.x(), o.y()) && domain.owns(o.x() + 7, o.y() + 7)) continue;
        for (auto it = leaf->beginValueOn(); it; ++it)
            if (!domain.owns(it.getCoord().x(), it.getCoord().y())) it.setValueOff();
    }
}

// Values for voxels the band has just reached: one cell beyond their nearest known neighbour, on its side.
void seed_new_voxels(LeafManager& leaves, const Grid& grid, const Domain& domain) {
    const float background = grid.background(), dx = static_cast<float>(domain.spacing);
    for_each_block(leaves, grid, domain, [&](const B& block, Leaf& leaf, float* out) {
        std::copy_n(leaf.buffer().data(), Leaf::SIZE, out);
        for (auto it = leaf.cbeginValueOn(); it; ++it) {
            const auto n = it.pos();
            if (!(std::abs(*it) >= background))
                continue;  // in the band before it grew, or not a number: reported later
            const int at =
                B::at(static_cast<int>(n >> 6), static_cast<int>(n >> 3 & 7), static_cast<int>(n & 7));
            float nearest = background;
            for (int stride : B::kStride)
                for (int step : {-stride, stride}) {
                    const float v = block.value[static_cast<std::size_t>(at + step)];
                    if (std::abs(v) < std::abs(nearest)) nearest = v;
                }
            // Just inside the background: known from now on, and on the side of the neighbour.
            const float limit = std::nextafter(background, 0.0f);
            out[n] = std::copysign(std::min(std::abs(nearest) + dx, limit), nearest);
        }
    });
    // The inactive voxels of leaves made just now still need their side.
    const openvdb::tools::SignedFloodFillOp<Grid::TreeType> flood(grid.tree());
    leaves.foreach ([&](Leaf& leaf, std::size_t) {
        if (!leaf.isEmpty()) flood(leaf);
    });
}

// Signed differences to both neighbours along an axis.
struct Differences {
    float minus, plus;
};

Differences differences(const B& block, int at, int stride) {
    const float v = block.value[static_cast<std::size_t>(at)];
    return {v - block.value[static_cast<std::size_t>(at - stride)],
            block.value[static_cast<std::size_t>(at + stride)] - v};
}

// The value of a node next to the front, scaled so that |grad phi| = 1. Slopes count as too flat or too steep
// only if both one-sided differences say so: at kinks and in curved regions they disagree, and nothing may
// creep there.
float rescaled(const B& block, int at, float v, float dx) {
    constexpr float kTolerance = 0.02f;  // of |grad phi|: smaller errors are left alone, too
    float steep = 0.0f, flat = 0.0f, crossed = 0.0f;
    for (int stride : B::kStride) {
        const auto [minus, plus] = differences(block, at, stride);
        const float a = std::abs(minus) / dx, b = std::abs(plus) / dx;
        steep += std::min(a, b) * std::min(a, b);
        flat += std::max(a, b) * std::max(a, b);
        // An edge that the front crosses is longer than the distances of both its ends together.
        if (a * dx > std::abs(v)) crossed = std::max(crossed, a);
        if (b * dx > std::abs(v)) crossed = std::max(crossed, b);
    }
    const float most = std::max(std::sqrt(steep), crossed), least = std::sqrt(flat);
    if (most > 1.0f + kTolerance) return v * (1.0f + kTolerance) / most;
    // A node at rest between two fronts has no slope at all; it must not be thrown away.
    if (least < 1.0f - kTolerance) return v * std::min(2.0f, (1.0f - kTolerance) / std::max(least, 0.1f));
    return v;
}

// Solves sum_k (w_k (u - a_k))^2 = 1 for u above the a_k that take part (Rouy and Tourin upwinding); the
// smallest arrive first and a later one only counts where it would be passed.
float upwind_distance(std::array<std::array<float, 2>, 3>& terms, int count) {
    std::sort(terms.begin(), terms.begin() + count, [](const auto& p, const auto& q) { return p[0] < q[0]; });
    float u = 0.0f, sum_w = 0.0f, sum_wa = 0.0f, sum_waa = 0.0f;
    for (int k = 0; k < count; ++k) {
        const auto [a, w] = terms[static_cast<std::size_t>(k)];
        if (k > 0 && u <= a) break;
        sum_w += w * w;
        sum_wa += w * w * a;
        sum_waa += w * w * a * a;
        const float discriminant = sum_wa * sum_wa - sum_w * (sum_waa - 1.0f);
        if (discriminant < 0.0f) break;
        u = (sum_wa + std::sqrt(discriminant)) / sum_w;
    }
    return u;
}

// Distance of a node away from the front from its upwind neighbours, in units of dx; `side` is the node's
// sign.
float solved(const B& block, int at, float side, float dx, float background) {
    std::array<std::array<float, 2>, 3> terms;
    int count = 0;
    for (int stride : B::kStride) {
        const auto value = [&](int offset) {
            return side * block.value[static_cast<std::size_t>(at + offset)];
        };
        const int step = value(-stride) < value(stride) ? -stride : stride;
        const float near = value(step), far = value(2 * step);
        if (near >= background) continue;
        // Second order where the next node still descends, first order where it is unknown or past a ridge.
        const bool second = far < near && far > -background;
        terms[static_cast<std::size_t>(count++)] =
            second ? std::array{(4.0f * near - far) / (3.0f * dx), 1.5f} : std::array{near / dx, 1.0f};
    }
    if (count == 0) return background;
    return std::min(background, dx * upwind_distance(terms, count));
}

}  // namespace

void redistance(Grid& grid, const Domain& domain, int passes) {
    const float background = grid.background(), dx = static_cast<float>(domain.spacing);
    grow_band(grid, domain);
    if (grid.activeVoxelCount() == 0)
        throw NumericsError(
            "the surface has vanished: no material boundary is left in the domain; shorten the step");
    LeafManager leaves(grid.tree(), 1);
    seed_new_voxels(leaves, grid, domain);
    std::atomic<bool> finite{true};
    for (int pass = 0; pass < passes; ++pass) {
        for_each_block(leaves, grid, domain, [&](B& block, Leaf& leaf, float* out) {
            std::copy_n(leaf.buffer().data(), Leaf::SIZE, out);
            // Nodes by distance, half a cell a bucket: within the leaf each sees its upwind neighbours' new
            // values.
            constexpr int kBuckets = 8;
            std::array<std::uint16_t, Leaf::SIZE> order;
            std::array<std::uint16_t, kBuckets + 1> start{};
            std::array<std::uint8_t, Leaf::SIZE> bucket;
            const float* v = leaf.buffer().data();
            for (auto it = leaf.cbeginValueOn(); it; ++it) {
                float d = std::abs(v[it.pos()]);
                if (!(d <= background)) {
                    finite = false;
                    d = 0.0f;
                }
                bucket[it.pos()] = static_cast<std::uint8_t>(std::min(kBuckets - 1.0f, 2.0f * d / dx));
                ++start[bucket[it.pos()] + 1u];
            }
            for (std::size_t b = 0; b < kBuckets; ++b)
                start[b + 1] = static_cast<std::uint16_t>(start[b + 1] + start[b]);
            const std::size_t count = start[kBuckets];
            for (auto it = leaf.cbeginValueOn(); it; ++it)
                order[start[bucket[it.pos()]]++] = static_cast<std::uint16_t>(it.pos());
            // First the nodes next to the front, all from old values; then the others outwards.
            std::array<std::uint16_t, Leaf::SIZE> others;
            std::size_t other_count = 0;
            for (std::size_t k = 0; k < count; ++k) {
                const unsigned n = order[k];
                const int at =
                    B::at(static_cast<int>(n >> 6), static_cast<int>(n >> 3 & 7), static_cast<int>(n & 7));
                bool at_front = false;
                for (int stride : B::kStride)
                    for (int step : {-stride, stride})
                        at_front |=
                            (block.value[static_cast<std::size_t>(at + step)] < 0.0f) != (v[n] < 0.0f);
                if (at_front)
                    out[n] = rescaled(block, at, v[n], dx);
                else
                    others[other_count++] = static_cast<std::uint16_t>(n);
            }
            for (std::size_t k = 0; k < count; ++k) {
                const unsigned n = order[k];
                block.value[static_cast<std::size_t>(
                    B::at(static_cast<int>(n >> 6), static_cast<int>(n >> 3 & 7), static_cast<int>(n & 7)))] =
                    out[n];
            }
            for (std::size_t k = 0; k < other_count; ++k) {
                const unsigned n = others[k];
                const int at =
                    B::at(static_cast<int>(n >> 6), static_cast<int>(n >> 3 & 7), static_cast<int>(n & 7));
                const float side = v[n] < 0.0f ? -1.0f : 1.0f;
                out[n] = side * solved(block, at, side, dx, background);
                block.value[static_cast<std::size_t>(at)] = out[n];
            }
        });
        if (!finite)
            throw NumericsError(
                "a level set value is not finite: a speed or a flux was; check the recipe's rates");
    }
    trim_band(grid, domain);
}

}  // namespace sidewall::levelset
