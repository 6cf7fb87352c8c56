#include "levelset/layers/level_features.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "levelset/block.hpp"
#include "levelset/layers/columns_between.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

using FeatureBlock = Block<1>;

// Nodes, in dx from the front, whose neighbours along edges and along axes all lie in the narrow band.
constexpr float kWithDiagonals = 1.5f, kWithFaces = 2.0f;

// A change of slope across a node, between the fronts of a gap or of a thin piece, is near 2; on a sphere
// whose radius is as its distance it is below this.
constexpr double kOpposing = 0.75;

// Second differences of phi at a node, per dx. Of a distance, their square sum is that of the principal
// curvatures.
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

// The box around a leaf's nodes of interest, along x and y.
struct NodeBox {
    std::array<int, 2> low{std::numeric_limits<int>::max(), std::numeric_limits<int>::max()};
    std::array<int, 2> high{std::numeric_limits<int>::min(), std::numeric_limits<int>::min()};

    void add(const openvdb::Coord& c) {
        for (std::size_t a = 0; a < 2; ++a) {
            low[a] = std::min(low[a], c[static_cast<int>(a)]);
            high[a] = std::max(high[a], c[static_cast<int>(a)]);
        }
    }
    bool empty() const { return low[0] > high[0]; }
};

// Cells of the coarser level from a feature to where it counts: the way the front may go until the columns
// are chosen anew, at most half a cell of the finest level a time step, and what an interpolation reads.
// Where two fronts meet at a small angle their line may go faster, but there the surface is nearly smooth.
int reach(const Domain& coarse) {
    constexpr int kInterpolated = 2;
    return kInterpolated + (kTimeStepsBetweenChoices / 2 + coarse.times_finest - 1) / coarse.times_finest;
}

// Marks the columns with cells within reach of the box.
void mark(const Domain& coarse, const NodeBox& box, LevelColumns& columns) {
    const int before = reach(coarse), after = before - 1;
    each_column_between(
        coarse, {box.low[0] - before, box.low[1] - before}, {box.high[0] + after, box.high[1] + after},
        LevelColumns::kShift - 1,
        [&](int x, int y) { std::atomic_ref(columns.at(x, y)).store(1, std::memory_order_relaxed); });
}

LevelColumns none_of(const MaterialStack& stack) {
    LevelColumns columns{stack.columns.count, {}};
    columns.own.assign(stack.columns.own.size(), 0);
    return columns;
}

// Whether a node of the level is not one of its margin, beside which nothing is known.
bool is_whole(const MaterialStack& level, int i, int j) {
    return !level.coarser || level.columns.of_node(i, j);
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
            if (!is_whole(*stack.coarser, o.x(), o.y())) continue;
            load_block(data, coarse, leaf, grid.background(), block);
            NodeBox box;
            for (auto it = leaf.cbeginValueOn(); it; ++it) {
                const float distance = std::abs(*it) / static_cast<float>(dx);
                if (distance > kWithFaces) continue;
                const openvdb::Coord c = it.getCoord();
                const double bend =
                    1.0 / (stack.columns.of_coarser_node(c.x(), c.y()) ? kGivenUp : kCoarseCells);
                if (is_feature(block, FeatureBlock::at(c.x() & 7, c.y() & 7, c.z() & 7), distance, dx, bend))
                    box.add(c);
            }
            if (!box.empty()) mark(coarse, box, columns);
        }
    });
}

// Speeds at a leaf's samples, and a straight line through them along each axis.
struct SpeedsOfLeaf {
    double count = 0.0, sum = 0.0;
    std::array<double, 3> place{}, squares{}, moment{};  // sums of x, x^2 and x v by axis
    NodeBox box;

    void add(const Eigen::Vector3i& node, double v) {
        ++count;
        sum += v;
        for (std::size_t a = 0; a < 3; ++a) {
            const double x = node[static_cast<int>(a)] & 7;
            place[a] += x, squares[a] += x * x, moment[a] += x * v;
        }
        box.add(openvdb::Coord(node.x(), node.y(), node.z()));
    }
    // The largest change a cell. That of single samples would be their noise.
    double steepest() const {
        double most = 0.0;
        for (std::size_t a = 0; a < 3; ++a) {
            const double spread = squares[a] - place[a] * place[a] / count;
            constexpr double kLeastSpread =
                0.5;  // of a sample; a front across the axis has nodes within a cell of it
            if (spread > kLeastSpread * count)
                most = std::max(most, std::abs(moment[a] - place[a] * sum / count) / spread);
        }
        return most;
    }
};

// Marks the coarser level's leaves in which the speed is not the same all over.
void mark_speeds(const MaterialStack& coarse, const Motion& motion, double most, LevelColumns& columns) {
    const auto& samples = motion.extension.samples;
    std::vector<const Leaf*> leaves;
    coarse.top().tree().getNodes(leaves);
    const surface::LeafTable table(leaves);
    std::vector<SpeedsOfLeaf> speeds(leaves.size());
    for (std::size_t n = 0; n < samples.size(); ++n) {  // in the order of leaves
        const Eigen::Vector3i& c = samples[n].node;
        const std::int32_t leaf = table.find(c.x() >> 3, c.y() >> 3, c.z() >> 3);
        if (leaf < 0 || !is_whole(coarse, c.x(), c.y())) continue;
        speeds[static_cast<std::size_t>(leaf)].add(
            c, motion.law.speed(n, exposed(coarse, motion, n), Vec3::UnitZ()));
    }
    for (const SpeedsOfLeaf& leaf : speeds)
        if (leaf.count > 0.0 && leaf.steepest() > kSpeedChange * most) mark(coarse.domain, leaf.box, columns);
}

}  // namespace

LevelColumns columns_of_features(const MaterialStack& stack) {
    LevelColumns columns = none_of(stack);
    for (const Layer& layer : stack.coarser->layers) mark_features(stack, *layer.phi, columns);
    return columns;
}

std::vector<LevelColumns> columns_of_speed(const MaterialStack& stack, const Motion& motion) {
    std::vector<LevelColumns> result;
    const double most = max_speed(stack, motion);
    const MaterialStack* level = &stack;
    const Motion* of = &motion;
    for (; level->coarser; level = level->coarser.get(), of = of->coarser.get()) {
        LevelColumns columns = most > 0.0 ? none_of(*level) : level->columns;
        // A speed that turns with the normal is the same on what is flat, and what is not is a feature.
        if (!motion.law.depends_on_normal && most > 0.0)
            mark_speeds(*level->coarser, *of->coarser, most, columns);
        result.push_back(std::move(columns));
    }
    return result;
}

}  // namespace sidewall::levelset
