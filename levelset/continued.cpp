#include "levelset/continued.hpp"

#include <openvdb/tree/LeafManager.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// How far from a node, in cells along an axis, its layer's own distances are looked for.
constexpr int kNodesAround = 2;

// Of a distance that a plane is fitted to.
constexpr double kLeastSlope = 0.7;

// The corners of a cell that both fronts pass through lie within two cells of either.
constexpr float kNearFront = 2.5f;

// A layer's own distances at a leaf's nodes and around them; NaN where it does not hold them.
class KnownValues {
  public:
    // \param next  the layer above.
    // \returns whether there are any.
    bool load(const Grid& layer, const Grid& next, const Domain& domain, const openvdb::Coord& origin) {
        const auto own = layer.getConstUnsafeAccessor(), above = next.getConstUnsafeAccessor();
        const auto touching = static_cast<float>(kExposed * domain.spacing);
        bool any = false;
        std::size_t n = 0;
        for (int x = -kNodesAround; x < 8 + kNodesAround; ++x)
            for (int y = -kNodesAround; y < 8 + kNodesAround; ++y)
                for (int z = -kNodesAround; z < 8 + kNodesAround; ++z, ++n) {
                    value_[n] = std::numeric_limits<float>::quiet_NaN();
                    const openvdb::Coord node(domain.source_node(0, origin.x() + x),
                                              domain.source_node(1, origin.y() + y), origin.z() + z);
                    float here = 0.0f;
                    if (!own.probeValue(node, here)) continue;
                    // A node of the layer's band that is not in the next one's lies inside it.
                    float there = 0.0f;
                    if (above.probeValue(node, there) && here - there <= touching) continue;
                    value_[n] = here;
                    any = true;
                }
        return any;
    }

    bool known(const openvdb::Coord& local) const {
        return !std::isnan(value_[at(local.x(), local.y(), local.z())]);
    }

    // What a plane through the known values around a node says there, or \p otherwise if they do not tell.
    float fitted(const openvdb::Coord& local, double spacing, float otherwise) const {
        Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
        Eigen::Vector4d right = Eigen::Vector4d::Zero();
        int count = 0;
        for (int x = -kNodesAround; x <= kNodesAround; ++x)
            for (int y = -kNodesAround; y <= kNodesAround; ++y)
                for (int z = -kNodesAround; z <= kNodesAround; ++z) {
                    const float value = value_[at(local.x() + x, local.y() + y, local.z() + z)];
                    if (std::isnan(value)) continue;
                    const double squared = x * x + y * y + z * z;
                    const double weight = 1.0 / (squared * squared);  // the nearest ones tell most
                    const Eigen::Vector4d row(1.0, x, y, z);
                    normal += weight * row * row.transpose();
                    right += weight * static_cast<double>(value) * row;
                    ++count;
                }
        if (count < 4) return otherwise;
        // Slopes that the nodes do not tell become none, and are seen from that: a distance rises by 1 a
        // cell.
        const double ridge = 1e-6 * normal.trace();
        for (int k = 1; k < 4; ++k) normal(k, k) += ridge;
        const Eigen::Vector4d plane = normal.ldlt().solve(right);
        return plane.tail<3>().norm() > kLeastSlope * spacing ? static_cast<float>(plane[0]) : otherwise;
    }

  private:
    static constexpr int kSide = 8 + 2 * kNodesAround;
    static std::size_t at(int x, int y, int z) {
        return static_cast<std::size_t>(((x + kNodesAround) * kSide + y + kNodesAround) * kSide + z +
                                        kNodesAround);
    }
    std::array<float, kSide * kSide * kSide> value_;
};

}  // namespace

std::vector<GridPtr> continued_fronts(const MaterialStack& stack) {
    std::vector<GridPtr> fronts;
    const float near = kNearFront * static_cast<float>(stack.domain.spacing),
                deep = -stack.top().background();
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k) {
        fronts.push_back(stack.layers[k].phi->deepCopy());
        openvdb::tree::LeafManager<Grid::TreeType> leaves(fronts.back()->tree());
        leaves.foreach ([&](Leaf& leaf, std::size_t) {
            KnownValues values;
            const bool any =
                values.load(*stack.layers[k].phi, *stack.layers[k + 1].phi, stack.domain, leaf.origin());
            for (auto it = leaf.beginValueOn(); it; ++it) {
                const openvdb::Coord local = it.getCoord() - leaf.origin();
                if (any && values.known(local)) continue;
                it.setValue(any && std::abs(*it) < near
                                ? std::min(*it, values.fitted(local, stack.domain.spacing, deep))
                                : deep);
            }
        });
    }
    return fronts;
}

}  // namespace sidewall::levelset
