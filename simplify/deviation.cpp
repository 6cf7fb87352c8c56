#include "simplify/deviation.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "simplify/triangle_distance.hpp"

namespace sidewall::simplify {
namespace {

constexpr std::uint32_t kNone = kNoHalfedge;

}  // namespace

Deviation::Deviation(const CollapseMesh& mesh)
    : corner_(mesh.corner), opposite_(mesh.opposite), leaving_(mesh.leaving) {
    const std::size_t n = leaving_.size();
    points_.resize(n);
    for (std::uint32_t v = 0; v < n; ++v) points_[v] = mesh.position(v);
    first_.assign(corner_.size() / 3, kNone);
    count_.assign(corner_.size() / 3, 0);
    next_.assign(n, kNone);
    for (std::uint32_t v = 0; v < n; ++v) {
        if (leaving_[v] == kNone) continue;
        next_[v] = first_[leaving_[v] / 3];
        first_[leaving_[v] / 3] = v;
        ++count_[leaving_[v] / 3];
    }
    home_.resize(n);
    std::iota(home_.begin(), home_.end(), 0u);
}

double Deviation::distance2_to_original(const Vec3& p, std::uint32_t& home) const {
    double nearest = (points_[home] - p).squaredNorm(), best = nearest;
    for (;;) {
        const std::uint32_t centre = home, first = leaving_[centre];
        std::uint32_t h = first;
        do {
            const std::uint32_t u = corner_[CollapseMesh::next(h)], w = corner_[CollapseMesh::previous(h)];
            best = std::min(best, distance2_to_triangle(points_[centre] - p, points_[u] - p, points_[w] - p));
            for (const std::uint32_t v : {u, w}) {
                const double distance = (points_[v] - p).squaredNorm();
                if (distance < nearest) nearest = distance, home = v;
            }
            h = opposite_[CollapseMesh::previous(h)];
        } while (h != kNone && h != first);
        if (home == centre) return best;
    }
}

bool Deviation::within(double limit, const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b,
                       const Vec3& place, std::span<const MovedTriangle> moved,
                       std::span<const std::uint32_t> gone, Plan& plan) const {
    const double limit2 = limit * limit;
    const double to_a = (points_[home_[a]] - place).squaredNorm(),
                 to_b = (points_[home_[b]] - place).squaredNorm();
    plan.home = to_b < to_a ? home_[b] : home_[a];
    if (!(distance2_to_original(place, plan.home) <= limit2)) return false;

    plan.points.clear();
    const auto distance2 = [&](const Vec3& p, const MovedTriangle& t) {
        return distance2_to_triangle(place - p, mesh.position(t.u) - p, mesh.position(t.w) - p);
    };
    const auto find = [&](std::uint32_t point, std::size_t guess) {
        const Vec3& p = points_[point];
        // Near enough is good enough: looking further for the nearest one makes no better mesh.
        const double enough = 0.0625 * limit2;
        double best = std::numeric_limits<double>::infinity();
        std::uint32_t triangle = kNone;
        for (std::size_t k = 0; k < moved.size() && !(best <= enough); ++k) {
            const MovedTriangle& t = moved[guess + k < moved.size() ? guess + k : guess + k - moved.size()];
            const double d = distance2(p, t);
            if (d < best) best = d, triangle = t.triangle;
        }
        plan.points.emplace_back(point, triangle);
        return best <= limit2;
    };
    for (const std::uint32_t t : gone)
        for (std::uint32_t p = first_[t]; p != kNone; p = next_[p])
            if (!find(p, 0)) return false;
    for (std::size_t i = 0; i < moved.size(); ++i)
        for (std::uint32_t p = first_[moved[i].triangle]; p != kNone; p = next_[p])
            if (!find(p, i)) return false;
    return true;
}

std::size_t Deviation::points_at(std::span<const MovedTriangle> moved,
                                 std::span<const std::uint32_t> gone) const {
    std::size_t points = 0;
    for (const std::uint32_t t : gone) points += count_[t];
    for (const MovedTriangle& t : moved) points += count_[t.triangle];
    return points;
}

void Deviation::apply(std::uint32_t a, std::span<const MovedTriangle> moved,
                      std::span<const std::uint32_t> gone, const Plan& plan) {
    for (const std::uint32_t t : gone) first_[t] = kNone, count_[t] = 0;
    for (const MovedTriangle& t : moved) first_[t.triangle] = kNone, count_[t.triangle] = 0;
    for (const auto& [point, triangle] : plan.points) {
        ++count_[triangle];
        next_[point] = first_[triangle];
        first_[triangle] = point;
    }
    home_[a] = plan.home;
}

}  // namespace sidewall::simplify
