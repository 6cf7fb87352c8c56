#include "levelset/layers/level_features.hpp"

#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <cstddef>

#include "levelset/block.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

using FeatureBlock = Block<1>;

// Distances from the front, in dx, within which diagonal or face neighbours all lie in the narrow band.
constexpr float kWithDiagonals = 1.5f, kWithFaces = 2.0f;

// Largest change of slope across a node along an axis with a single front near. Between the two fronts of a
// gap or a thin piece it is near 2; on a sphere with the node's distance as its radius it is below this.
constexpr double kOpposing = 0.75;

// Second differences of phi at a node, over dx. The sum of their squares is that of the principal curvatures
// (per cell) if phi is a distance.
class Hessian {
  public:
    Hessian(const FeatureBlock& block, int at, double dx)
        : value_(&block.value[static_cast<std::size_t>(at)]), dx_(dx) {}

    double along(std::size_t a) const {
        const auto s = static_cast<std::ptrdiff_t>(FeatureBlock::kStride[a]);
        return (at(s) - 2.0 * at(0) + at(-s)) / dx_;
    }
    double mixed(std::size_t a, std::size_t b) const {
        const auto s = static_cast<std::ptrdiff_t>(FeatureBlock::kStride[a]),
                   t = static_cast<std::ptrdiff_t>(FeatureBlock::kStride[b]);
        return 0.25 * (at(s + t) - at(s - t) - at(t - s) + at(-s - t)) / dx_;
    }

  private:
    double at(std::ptrdiff_t n) const { return static_cast<double>(value_[n]); }
    const float* value_;
    double dx_;
};

// Whether a node shows a radius of curvature below 1 / \p bend cells, or two fronts that face each other.
bool is_feature(const FeatureBlock& block, int at, float distance, double dx, double bend) {
    const Hessian h(block, at, dx);
    const std::array<double, 3> diagonal{h.along(0), h.along(1), h.along(2)};
    if (std::any_of(diagonal.begin(), diagonal.end(), [](double d) { return std::abs(d) > kOpposing; }))
        return true;
    if (distance > kWithDiagonals) return false;
    double squares = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
        squares += diagonal[a] * diagonal[a];
        for (std::size_t b = 0; b < a; ++b) squares += 2.0 * h.mixed(a, b) * h.mixed(a, b);
    }
    return squares > bend * bend;
}

// Distance around a feature, in cells of the coarser level, in which the finer one has to count: the front's
// path until columns are chosen anew, at most half a cell of the finest level a time step, and the reach of
// an interpolation. The line in which two fronts meet at a small angle may be faster, but there the surface
// is nearly smooth.
int reach(const Domain& coarse) {
    constexpr int kInterpolated = 2;
    return kInterpolated + (kTimeStepsBetweenChoices / 2 + coarse.times_finest - 1) / coarse.times_finest;
}

void mark_features(const MaterialStack& stack, const Grid& grid, LevelColumns& columns) {
    const Domain& coarse = stack.coarser->domain;
    const double dx = coarse.spacing;
    std::vector<const Leaf*> leaves;
    grid.tree().getNodes(leaves);
    const surface::LeafTable table(leaves);
    const LeafData data(table, leaves);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
        FeatureBlock block;
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Leaf& leaf = *leaves[n];
            const openvdb::Coord o = leaf.origin();
            if (!counts_at(*stack.coarser, nullptr, o.x(), o.y()))
                continue;  // a margin's leaves lack neighbours
            load_block(data, coarse, leaf, grid.background(), block);
            NodeBox box;
            for (auto it = leaf.cbeginValueOn(); it; ++it) {
                const float distance = std::abs(*it) / static_cast<float>(dx);
                if (distance > kWithFaces) continue;
                const openvdb::Coord c = it.getCoord();
                const double bend = 1.0 / (stack.columns.of_coarser_node(c.x(), c.y()) ? kGivenUp : kNeeded);
                if (is_feature(block, FeatureBlock::at(c.x() & 7, c.y() & 7, c.z() & 7), distance, dx, bend))
                    box.add(c.x(), c.y());
            }
            if (!box.empty()) mark_columns(coarse, box, columns);
        }
    });
}

}  // namespace

void mark_columns(const Domain& coarse, const NodeBox& box, LevelColumns& columns) {
    const int before = reach(coarse), after = before - 1;
    each_column_between(
        coarse, {box.low[0] - before, box.low[1] - before}, {box.high[0] + after, box.high[1] + after},
        LevelColumns::kShift - 1,
        [&](int x, int y) { std::atomic_ref(columns.at(x, y)).store(1, std::memory_order_relaxed); });
}

LevelColumns columns_of_features(const MaterialStack& stack) {
    LevelColumns columns = stack.columns.none();
    for (const Layer& layer : stack.coarser->layers) mark_features(stack, *layer.phi, columns);
    return columns;
}

}  // namespace sidewall::levelset
