#include "levelset/motion/motion.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "levelset/layers/level_features.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/error.hpp"
#include "surface/extraction/leaf_table.hpp"

namespace sidewall::levelset {
namespace {

// Speeds at a leaf's samples, and the straight line fitted to them along each axis.
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
    // The largest slope per cell. Differences of single samples would be their noise.
    double steepest() const {
        double most = 0.0;
        for (std::size_t a = 0; a < 3; ++a) {
            const double spread = squares[a] - place[a] * place[a] / count;
            constexpr double kLeastSpread = 0.5;  // cells^2 a sample: less if the front is across the axis
            if (spread > kLeastSpread * count)
                most = std::max(most, std::abs(moment[a] - place[a] * sum / count) / spread);
        }
        return most;
    }
};

// Marks the columns of the coarser level's leaves in which the speed changes along the surface.
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

std::array<std::size_t, kSpeedClasses> first_of_classes(std::span<const std::uint8_t> speed_class) {
    using First = std::array<std::size_t, kSpeedClasses>;
    First none;
    none.fill(speed_class.size());
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, speed_class.size(), 16384), none,
        [&](const auto& range, First first) {
            for (std::size_t n = range.end(); n-- > range.begin();)
                first[speed_class[n]] = std::min(first[speed_class[n]], n);
            return first;
        },
        [](First a, const First& b) {
            for (std::size_t k = 0; k < kSpeedClasses; ++k) a[k] = std::min(a[k], b[k]);
            return a;
        });
}

namespace {

// Normals that bound V: it depends on n . d <= 1 or crystal directions only, so axes and diagonals suffice.
std::vector<Vec3> bounding_normals(const Motion& motion) {
    std::vector<Vec3> normals{Vec3::UnitZ()};
    if (!motion.law.depends_on_normal) return normals;
    normals.clear();
    for (int n = 0; n < 27; ++n)
        if (n != 13)
            normals.push_back(
                Eigen::Vector3i(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1).cast<double>().normalized());
    return normals;
}

// The largest |V| of a layer at a sample.
double fastest(const MaterialStack& stack, const Motion& motion, const std::vector<Vec3>& normals,
               std::size_t sample, std::size_t layer) {
    double most = 0.0;
    for (const Vec3& normal : normals) {
        const double v = motion.law.speed(sample, layer, normal);
        if (!std::isfinite(v)) {
            const auto& c = motion.extension.samples[sample].node;
            throw NumericsError(
                "the surface speed at ({:.4g}, {:.4g}, {:.4g}) is {}: check the step's rates "
                "and fluxes",
                stack.domain.coordinate(0, c.x()), stack.domain.coordinate(1, c.y()),
                stack.domain.coordinate(2, c.z()), v);
        }
        most = std::max(most, std::abs(v));
    }
    return most;
}

// The normals of the front at a sample: the surface's and, at a node outside a convex edge, where a facet may
// begin, the direction from the edge to the node.
std::vector<Vec3> own_normals(const Motion& motion, std::size_t sample) {
    constexpr float kAlong = 0.95f;
    const Eigen::Vector3f &foot = motion.extension.samples[sample].foot, &normal = motion.law.normal[sample];
    const float outwards = -foot.dot(normal);
    std::vector<Vec3> normals{normal.cast<double>()};
    if (outwards > 0.0f && outwards < kAlong * foot.norm())
        normals.push_back(-foot.cast<double>().normalized());
    return normals;
}

// Calls use(layer) for the layer that is bare at a sample and for those less than a cell below.
template <class Use>
void each_reachable(const MaterialStack& stack, const Motion& motion, std::size_t sample, Use&& use) {
    const std::size_t surface = exposed(stack, motion.extension, sample), below = stack.layers.size() - 1;
    for (std::size_t k = 0; k <= surface; ++k) {
        const bool reachable =
            k == surface ||
            static_cast<double>(motion.extension.thickness[sample * below + k]) < stack.domain.spacing;
        if (reachable && (motion.law.inert.empty() || !motion.law.inert[k])) use(k);
    }
}

// The largest |V| at the samples of a level, without those in \p finer, where a finer level counts (or null).
double max_speed_of_level(const MaterialStack& stack, const Motion& motion, const LevelColumns* finer) {
    const auto counts = [&](std::size_t sample) {
        const auto& c = motion.extension.samples[sample].node;
        return finer == nullptr || !finer->of_coarser_node(c.x(), c.y());
    };
    const std::vector<Vec3> normals = bounding_normals(motion);
    const std::size_t layers = stack.layers.size();
    const bool by_class = !motion.law.speed_class.empty();
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, motion.extension.samples.size(), 512), 0.0,
        [&](const auto& range, double most) {
            std::vector<std::uint8_t> asked(by_class ? kSpeedClasses * layers : 0, 0);
            for (std::size_t n = range.begin(); n != range.end(); ++n)
                if (counts(n))
                    each_reachable(stack, motion, n, [&](std::size_t k) {
                        if (by_class && std::exchange(asked[motion.law.speed_class[n] * layers + k], 1) != 0)
                            return;
                        most = std::max(most, motion.law.normal.empty()
                                                  ? fastest(stack, motion, normals, n, k)
                                                  : fastest(stack, motion, own_normals(motion, n), n, k));
                    });
            return most;
        },
        [](double a, double b) { return std::max(a, b); });
}

}  // namespace

double max_speed(const MaterialStack& stack, const Motion& motion) {
    double most = max_speed_of_level(stack, motion, nullptr);
    const MaterialStack* level = &stack;
    for (const Motion* of = &motion; level->coarser; level = level->coarser.get(), of = of->coarser.get())
        most = std::max(most, max_speed_of_level(*level->coarser, *of->coarser, &level->columns));
    return most;
}

std::vector<LevelColumns> columns_of_speed(const MaterialStack& stack, const Motion& motion) {
    std::vector<LevelColumns> result;
    const double most = max_speed(stack, motion);
    const MaterialStack* level = &stack;
    const Motion* of = &motion;
    for (; level->coarser; level = level->coarser.get(), of = of->coarser.get()) {
        LevelColumns columns = most > 0.0 ? level->columns.none() : level->columns;
        // A speed by the normal alone is uniform on flat surfaces, and curved ones are features anyway.
        const bool by_normal = motion.law.depends_on_normal && !motion.law.speed_class.empty();
        if (!by_normal && most > 0.0) mark_speeds(*level->coarser, *of->coarser, most, columns);
        result.push_back(std::move(columns));
    }
    return result;
}

}  // namespace sidewall::levelset
