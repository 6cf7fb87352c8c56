#include "levelset/limits.hpp"

#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace sidewall::levelset {
namespace {

using LeafManager = openvdb::tree::LeafManager<Grid::TreeType>;

constexpr float kUnlimited = std::numeric_limits<float>::infinity();

// How far the bodies below the surface let it recede at each node. One a thread.
class Bodies {
  public:
    Bodies(const MaterialStack& stack, const Grid& before, const Motion& motion, double duration)
        : stack_(stack),
          motion_(motion),
          duration_(duration),
          before_(before.getConstUnsafeAccessor()),
          sample_of_(*motion.extension.sample_of) {
        for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k)
            layers_.push_back(stack.layers[k].phi->getConstUnsafeAccessor());
    }

    // What phi may be after the time step at a node, by the bodies that it lies in.
    float limit(const openvdb::Coord& node) const {
        float least = kUnlimited;
        std::int32_t sample = -1;
        if (!sample_of_.probeValue(node, sample) || sample < 0) return least;
        const float was = before_.getValue(node);
        if (!(was < 0.0f)) return least;
        const auto index = static_cast<std::size_t>(sample);
        const std::size_t own = exposed(stack_, motion_, index);
        const auto touching = static_cast<float>(kExposed * stack_.domain.spacing);
        for (std::size_t k = std::max<std::size_t>(own, 1); k <= layers_.size(); ++k) {
            float below = 0.0f, upper = was;
            if (!layers_[k - 1].probeValue(node, below)) continue;
            if (k < layers_.size() && !layers_[k].probeValue(node, upper)) continue;
            // In the body, or on its underside; where layers coincide it is not there.
            if (!(upper < 0.0f) || -below > touching || below - upper <= touching) continue;
            const double lost = most_lost(index, k);
            if (k > own || lost == 0.0)
                least = std::min(least, std::max(upper, -below) + static_cast<float>(lost));
        }
        return least;
    }

  private:
    double most_lost(std::size_t sample, std::size_t layer) const {
        if (!motion_.depends_on_normal)
            return std::max(0.0, -motion_.speed(sample, layer, Vec3::UnitZ()) * duration_);
        // Without the normal all that is known of a body that etches is the rate of its fastest face: no
        // limit.
        const bool inert = motion_.max_etch_rate && motion_.max_etch_rate(sample, layer) == 0.0;
        return inert ? 0.0 : std::numeric_limits<double>::infinity();
    }

    const MaterialStack& stack_;
    const Motion& motion_;
    double duration_;
    Grid::ConstUnsafeAccessor before_;
    openvdb::tree::ValueAccessor<const IndexTree, false> sample_of_;
    std::vector<Grid::ConstUnsafeAccessor> layers_;
};

// In cells, what re-distancing and an etch of the body may add to a depth of a whole cell or none. With 0.005
// an undercut mask loses its corners on nodes, with 0.3 slanted faces are held (stack_test.cpp: "a mask
// undercut by four times its thickness", "a mask that does not etch").
constexpr float kDepthTolerance = 0.05f;

// A body's corner on a node lies on its faces, not in it, and has no limit of its own: there the body's depth
// is a whole cell at a diagonal neighbour and none at the others. Slanted faces have depths between.
float corner_limit(const openvdb::tree::ValueAccessor<const Grid::TreeType, false>& own,
                   const openvdb::Coord& node, float was, float dx) {
    if (std::abs(was) > static_cast<float>(kExposed) * dx) return kUnlimited;
    bool corner = false;
    for (int n = 0; n < 27; ++n) {
        const openvdb::Coord offset(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        const float depth = -own.getValue(node + offset) / dx;
        if (depth <= kDepthTolerance) continue;
        const bool diagonal = std::abs(offset.x()) + std::abs(offset.y()) + std::abs(offset.z()) > 1;
        if (!diagonal || depth < 1.0f - kDepthTolerance) return kUnlimited;
        corner = true;
    }
    return corner ? std::max(was, 0.0f) : kUnlimited;
}

}  // namespace

Grid::TreeType::Ptr limits_of(const MaterialStack& stack, const Grid& before, const Motion& motion,
                              double duration) {
    const auto unlimited = [&] {
        return std::make_shared<Grid::TreeType>(before.tree(), kUnlimited, openvdb::TopologyCopy());
    };
    const Grid::TreeType::Ptr own = unlimited();
    Grid::TreeType::Ptr result = unlimited();
    LeafManager(*own).foreach ([&](Leaf& leaf, std::size_t) {
        const Bodies bodies(stack, before, motion, duration);
        for (auto it = leaf.beginValueOn(); it; ++it) it.setValue(bodies.limit(it.getCoord()));
    });
    const auto dx = static_cast<float>(stack.domain.spacing);
    LeafManager(*result).foreach ([&](Leaf& leaf, std::size_t) {
        const openvdb::tree::ValueAccessor<const Grid::TreeType, false> at(*own);
        const Leaf& was = *before.tree().probeConstLeaf(leaf.origin());
        for (auto it = leaf.beginValueOn(); it; ++it) {
            const openvdb::Coord node = it.getCoord();
            float limit = at.getValue(node);
            for (int axis = 0; axis < 3; ++axis)
                for (const int side : {-1, 1}) {
                    openvdb::Coord next = node;
                    next[axis] += side;
                    limit = std::min(limit, at.getValue(next) + dx);
                }
            it.setValue(std::min(limit, corner_limit(at, node, was.getValue(it.pos()), dx)));
        }
    });
    return result;
}

void keep_within(Grid& phi, const Grid::TreeType& limits) {
    const float least = std::nextafter(-phi.background(), 0.0f);
    LeafManager(phi.tree()).foreach ([&](Leaf& leaf, std::size_t) {
        const Leaf* limit = limits.probeConstLeaf(leaf.origin());
        if (limit == nullptr) return;
        for (auto it = leaf.beginValueOn(); it; ++it)
            if (*it > limit->getValue(it.pos())) it.setValue(std::max(limit->getValue(it.pos()), least));
    });
}

}  // namespace sidewall::levelset
