#include "levelset/layers/layers_below.hpp"

#include <cmath>

namespace sidewall::levelset {
namespace {

constexpr int kSampleReach = 2;  // in nodes, from the node nearest to the foot point

// Whether voxels within the margin lie across a periodic side; they are not searched, so all counts as near.
bool beside_periodic_side(const Domain& domain, const openvdb::Coord& origin, int margin) {
    for (int axis = 0; axis < 2; ++axis)
        if (domain.side[static_cast<std::size_t>(axis)] == Side::periodic &&
            (origin[axis] < 8 || origin[axis] + 7 + margin > domain.last_node(axis)))
            return true;
    return false;
}

}  // namespace

bool LayersBelow::none_around(const MaterialStack& stack, const openvdb::Coord& origin) {
    if (beside_periodic_side(stack.domain, origin, 8)) return false;
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k) {
        const auto layer = stack.layers[k].phi->getConstUnsafeAccessor();
        for (int n = 0; n < 27; ++n)
            if (layer.probeConstLeaf(origin.offsetBy(8 * (n / 9 - 1), 8 * (n / 3 % 3 - 1), 8 * (n % 3 - 1))))
                return false;
    }
    return true;
}

LayersBelow::LayersBelow(const MaterialStack& stack, const openvdb::Coord& origin) {
    const auto row = [](int x, int y) {
        return static_cast<std::size_t>((x + kMargin) * kSide + y + kMargin);
    };
    if (beside_periodic_side(stack.domain, origin, kMargin)) {
        any_ = true;
        near_.fill(0xffff);
        return;
    }
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k) {
        const auto layer = stack.layers[k].phi->getConstUnsafeAccessor();
        for (int n = 0; n < 27; ++n) {
            const openvdb::Coord at(8 * (n / 9 - 1), 8 * (n / 3 % 3 - 1), 8 * (n % 3 - 1));
            const Leaf* leaf = layer.probeConstLeaf(origin + at);
            if (leaf == nullptr) continue;
            any_ = true;
            for (int x = std::max(at.x(), -kMargin); x < std::min(at.x() + 8, 8 + kMargin); ++x)
                for (int y = std::max(at.y(), -kMargin); y < std::min(at.y() + 8, 8 + kMargin); ++y) {
                    const auto bits = static_cast<std::uint32_t>(leaf->getValueMask().getWord<openvdb::Byte>(
                        static_cast<openvdb::Index>((x & 7) << 3 | (y & 7))));
                    const int shift = at.z() + kMargin;
                    near_[row(x, y)] |=
                        static_cast<std::uint16_t>(shift >= 0 ? bits << shift : bits >> -shift);
                }
        }
    }
    if (!any_) return;
    for (std::uint16_t& r : near_) {
        const std::uint32_t b = r;
        r = static_cast<std::uint16_t>(b | b << 1 | b << 2 | b >> 1 | b >> 2);
    }
    const auto spread = [&](int dx, int dy) {
        const auto from = near_;
        for (int x = -1; x <= 8; ++x)
            for (int y = -kMargin; y < 8 + kMargin; ++y)
                for (int step = -kSampleReach; step <= kSampleReach; ++step) {
                    const int i = x + step * dx, j = y + step * dy;
                    if (j >= -kMargin && j < 8 + kMargin) near_[row(x, y)] |= from[row(i, j)];
                }
    };
    spread(1, 0);
    spread(0, 1);
}

bool LayersBelow::none_near(const openvdb::Coord& node, const Vec3& foot) const {
    if (!any_) return true;
    int at[3];
    for (int a = 0; a < 3; ++a) at[a] = (node[a] & 7) + static_cast<int>(std::floor(foot[a] + 0.5));
    const std::uint32_t r = near_[static_cast<std::size_t>((at[0] + kMargin) * kSide + at[1] + kMargin)];
    return (r >> (at[2] + kMargin) & 1) == 0;
}

}  // namespace sidewall::levelset
