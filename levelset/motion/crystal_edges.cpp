#include "levelset/motion/crystal_edges.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/grid.hpp"
#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

// Unit vectors from the edge of a body's cover to a node (way), across the edge and along it.
struct FromEdge {
    Vec3 way, across, along;
};

// The directions at a node; none if it lies straight behind the bare surface. The edge is perpendicular to
// the line from it to the node and to the normal of the covered surface. That is the gradient of the body's
// phi where the covered surface is the closest one: at the node, or up to kInside cells farther inside. Of
// these gradients the one most perpendicular to the line is taken.
std::optional<FromEdge> from_edge(const MaterialStack& stack, const SurfaceSample& at, std::size_t body) {
    constexpr int kInside = 3;
    constexpr double kStraight = 0.3, kOnEdge = 0.05, kFarthest = 2.5;  // sine; cells; cells
    const Vec3 foot = at.foot.cast<double>();
    if (foot.norm() < kOnEdge || foot.norm() > kFarthest) return std::nullopt;
    const auto phi = stack.layers[body].phi->getConstUnsafeAccessor();
    FromEdge from{-foot.normalized(), Vec3::Zero(), Vec3::Zero()};
    for (int cells = 0; cells <= kInside; ++cells) {
        Eigen::Vector3i place;
        for (int axis = 0; axis < 3; ++axis)
            place[axis] = at.node[axis] + static_cast<int>(std::lround(cells * from.way[axis]));
        const auto value = [&](int axis, int step) {
            Eigen::Vector3i node = place;
            node[axis] += step;
            return static_cast<double>(phi.getValue(
                {stack.domain.source_node(0, node.x()), stack.domain.source_node(1, node.y()), node.z()}));
        };
        const Vec3 rise =
            Vec3(value(0, 1) - value(0, -1), value(1, 1) - value(1, -1), value(2, 1) - value(2, -1))
                .normalized();
        const Vec3 aside = rise - rise.dot(from.way) * from.way;
        if (aside.norm() > from.across.norm()) from.across = aside;
    }
    if (!(from.across.norm() > kStraight)) return std::nullopt;
    from.across.normalize();
    from.along = from.way.cross(from.across);
    return from;
}

}  // namespace

std::optional<double> crystal_edge_speed(const MaterialStack& stack, std::span<const Vec3> planes,
                                         const SurfaceSample& at, std::size_t body, double fastest,
                                         const std::function<double(const Vec3& normal)>& speed_of) {
    constexpr int kTurns = 22;  // directions on either side, 4 degrees apart
    // kParallel: sine below which a plane is parallel to the edge. kAtCorner: at a corner, the edge's line is
    // more cells than this off the surface one cell farther on. kSlow: share of the fastest rate that stops
    // the front. kAlong: least cosine between a plane's normal and the line from edge to node.
    constexpr double kParallel = 0.17, kAtCorner = 0.4, kSlow = 0.1, kAlong = 0.02;
    const auto from = from_edge(stack, at, body);
    if (!from) return std::nullopt;
    const auto arrives = [&](const Vec3& inwards) {
        const double way = inwards.dot(from->way);
        return way > kAlong ? speed_of(-inwards) / way : -std::numeric_limits<double>::infinity();
    };
    const double dx = stack.domain.spacing;
    const Vec3 edge = surface_point(at, stack.domain);
    double off = 0.0;
    for (const double side : {-dx, dx})
        off = std::max(off, std::abs(distance_at(stack.top(), stack.domain, edge + side * from->along)));
    const bool corner = off > kAtCorner * dx;
    double last = arrives(from->way);
    for (const Vec3& plane : planes) {
        if (corner || std::abs(plane.dot(from->along)) < kParallel) last = std::max(last, arrives(plane));
        if (last > -kSlow * fastest) return std::nullopt;
    }
    for (int n = -kTurns; n <= kTurns; ++n) {
        const double angle = 0.5 * std::numbers::pi * n / (kTurns + 1);
        last = std::max(last, arrives(std::cos(angle) * from->way + std::sin(angle) * from->across));
    }
    return last;
}

}  // namespace sidewall::levelset
