#include "levelset/edge_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "levelset/rounding.hpp"

namespace sidewall::levelset {
namespace {

using Stencil = Block<2>;

// Two planes whose normals have a larger cosine than this count as one plane.
constexpr float kParallel = 0.98f;

// The plane nearest to an upwind neighbour of the node; lengths in cells.
struct Plane {
    float arrival;                      // the neighbour's own distance
    float distance;                     // the node's distance from the plane
    Eigen::Vector3f normal, neighbour;  // neighbour: its offset from the node
};

// Unit gradient of the distance at a node. Of three estimates the one with length nearest to 1 is taken:
// upwind differences (best where a plane begins), central ones (where the distance fans out from an edge),
// and one-sided ones on the node's side of the front (where another plane is nearest beyond the front).
Eigen::Vector3f normal_at(const float* v, float inv_dx) {
    constexpr float kNearer = 1e-3f;  // smaller differences of length do not count
    Eigen::Vector3f upwind, central, own_side;
    for (int axis = 0; axis < 3; ++axis) {
        const int stride = Stencil::kStride[axis];
        const float minus = inv_dx * v[-stride], plus = inv_dx * v[stride], own = inv_dx * *v;
        const float near = std::min(minus, plus), next = std::max(minus, plus),
                    rise = std::max(0.0f, own - near);
        const float sign = minus < plus ? 1.0f : -1.0f;
        upwind[axis] = sign * rise;
        central[axis] = 0.5f * (plus - minus);
        own_side[axis] =
            near < -kTie && next - near > kTie ? sign * std::max(rise, next - own) : upwind[axis];
    }
    Eigen::Vector3f best = upwind;
    const auto off = [](const Eigen::Vector3f& g) { return std::abs(g.norm() - 1.0f); };
    for (const Eigen::Vector3f& other : {central, own_side})
        if (off(other) < off(best) - kNearer) best = other;
    const float length = best.norm();
    return length > 0.0f ? Eigen::Vector3f(best / length) : best;
}

bool diverge(const Plane& a, const Plane& b) {
    return (a.normal - b.normal).dot(a.neighbour - b.neighbour) > 0.0f;
}

// Distance from the edge in which two planes meet, or from the plane on which the nearest point lies.
float beyond_two(const Plane& a, const Plane& b) {
    const float c = a.normal.dot(b.normal);
    const float of_a = a.distance - c * b.distance, of_b = b.distance - c * a.distance;
    if (of_a < 0.0f || of_b < 0.0f) return std::max(a.distance, b.distance);
    return std::sqrt((a.distance * of_a + b.distance * of_b) / (1.0f - c * c));
}

// Distance from the corner of three planes, 0 if the nearest point is not there.
float beyond_three(const std::array<Plane, 3>& planes) {
    constexpr float kLeastVolume = 0.05f;  // |determinant| of the normals: below, they meet in an edge
    Eigen::Matrix3f normals;
    Eigen::Vector3f distances;
    for (int k = 0; k < 3; ++k) {
        normals.row(k) = planes[static_cast<std::size_t>(k)].normal;
        distances[k] = planes[static_cast<std::size_t>(k)].distance;
    }
    if (std::abs(normals.determinant()) < kLeastVolume) return 0.0f;
    const Eigen::Matrix3f products = normals * normals.transpose();
    const Eigen::Vector3f multipliers = products.inverse() * distances;
    if (multipliers.minCoeff() < 0.0f) return 0.0f;
    return std::sqrt(std::max(0.0f, distances.dot(multipliers)));
}

}  // namespace

EdgeDistance edge_distance(const float* v, float u, float inv_dx, float farthest) {
    std::array<Plane, 3> planes;
    std::size_t count = 0;
    bool descends = true;  // along every axis, the node behind the neighbour is nearer still to the front
    float convex = 0.0f, hollow = 0.0f;  // the largest second differences of either sign
    for (int axis = 0; axis < 3; ++axis) {
        const int stride = Stencil::kStride[axis];
        const float minus = inv_dx * v[-stride], plus = inv_dx * v[stride];
        const int towards = minus < plus ? -1 : 1;
        const float near = std::min(minus, plus), behind = inv_dx * v[2 * towards * stride],
                    next = std::max(minus, plus);
        if (near >= std::min(u, farthest) - kTie) continue;
        convex = std::max(convex, u - 2.0f * near + behind);
        descends = descends && behind < near;
        if (next < farthest - kTie) hollow = std::max(hollow, 2.0f * u - near - next);
        planes[count++] = {near, 0.0f, Eigen::Vector3f::Zero(),
                           static_cast<float>(towards) * Eigen::Vector3f::Unit(axis)};
    }
    if (count < 2 || std::max(convex, hollow) <= kSharpBend) return {u, false};
    for (std::size_t k = 0; k < count; ++k) {
        Plane& plane = planes[k];
        std::ptrdiff_t offset = 0;
        for (int axis = 0; axis < 3; ++axis)
            offset += static_cast<std::ptrdiff_t>(plane.neighbour[axis]) * Stencil::kStride[axis];
        plane.normal = normal_at(v + offset, inv_dx);
        plane.distance = plane.arrival - plane.normal.dot(plane.neighbour);
    }
    const auto put_in_order = [&](std::size_t a, std::size_t b) {
        if (planes[b].arrival < planes[a].arrival - kTie) std::swap(planes[a], planes[b]);
    };
    put_in_order(0, 1);
    if (count == 3) {
        put_in_order(1, 2);
        put_in_order(0, 1);
    }
    // Neighbours over the same plane count once, by the nearest.
    if (count == 3 && planes[0].normal.dot(planes[1].normal) > kParallel) planes[1] = planes[--count];
    const Plane &first = planes[0], &second = planes[1];
    if (first.normal.dot(second.normal) > kParallel) return {u, false};
    if (!diverge(first, second))
        return {hollow > kSharpBend ? std::min(first.distance, second.distance) : u, false};
    if (convex <= kSharpBend) return {u, false};
    float result = beyond_two(first, second);
    if (count == 3 && planes[2].arrival < result - kTie) {
        const auto also = [&](const Plane& a, const Plane& b) {
            if (a.normal.dot(b.normal) <= kParallel && diverge(a, b))
                result = std::max(result, beyond_two(a, b));
        };
        also(first, planes[2]);
        also(second, planes[2]);
        result = std::max(result, beyond_three(planes));
    }
    // Differences along the axes (u) fall short in the fan of an edge, so that inside the material the result
    // may exceed them. They bound it in the gas, where the cusp between films from two rims would rise
    // (void_figures_test.cpp), and where a neighbour is no farther from the front than the node behind it, as
    // in an undercut mask: its plane may be out of date.
    return {descends && inv_dx < 0.0f ? std::min(result, first.arrival + 1.0f) : std::min(u, result), true};
}

}  // namespace sidewall::levelset
