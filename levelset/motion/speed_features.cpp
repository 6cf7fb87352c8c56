#include "levelset/motion/speed_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "levelset/layers/level_features.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {
namespace {

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
        box.add(node.x(), node.y());
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
    for (std::size_t n = 0; n < motion.extension.plain(); ++n) {  // in the order of leaves
        const Eigen::Vector3i& c = samples[n].node;
        const std::int32_t leaf = table.find(c.x() >> 3, c.y() >> 3, c.z() >> 3);
        if (leaf < 0 || !counts_at(coarse, nullptr, c.x(), c.y())) continue;
        speeds[static_cast<std::size_t>(leaf)].add(
            c, motion.law.speed(n, exposed(coarse, motion.extension, n), Vec3::UnitZ()));
    }
    for (const SpeedsOfLeaf& leaf : speeds)
        if (leaf.count > 0.0 && leaf.steepest() > kSpeedChange * most)
            mark_columns(coarse.domain, leaf.box, columns);
}

}  // namespace

std::vector<LevelColumns> columns_of_speed(const MaterialStack& stack, const Motion& motion) {
    std::vector<LevelColumns> result;
    const double most = max_speed(stack, motion);
    const MaterialStack* level = &stack;
    const Motion* of = &motion;
    for (; level->coarser; level = level->coarser.get(), of = of->coarser.get()) {
        LevelColumns columns = most > 0.0 ? level->columns.none() : level->columns;
        // A speed by the normal alone is the same on what is flat, and what is not is a feature.
        const bool by_normal = motion.law.depends_on_normal && !motion.law.speed_class.empty();
        if (!by_normal && most > 0.0) mark_speeds(*level->coarser, *of->coarser, most, columns);
        result.push_back(std::move(columns));
    }
    return result;
}

}  // namespace sidewall::levelset
