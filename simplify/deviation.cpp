#include "simplify/deviation.hpp"

#include <algorithm>
#include <numeric>

namespace sidewall::simplify {
namespace {

constexpr std::uint32_t kNone = kNoHalfedge;

/// Squared distance from the origin to the triangle a, b, c. Ericson, Real-Time Collision Detection, 2005,
/// section 5.1.5.
double distance2_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a;
    const double d1 = -ab.dot(a), d2 = -ac.dot(a);
    if (d1 <= 0.0 && d2 <= 0.0) return a.squaredNorm();
    const double d3 = -ab.dot(b), d4 = -ac.dot(b);
    if (d3 >= 0.0 && d4 <= d3) return b.squaredNorm();
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return (a + d1 / (d1 - d3) * ab).squaredNorm();
    const double d5 = -ab.dot(c), d6 = -ac.dot(c);
    if (d6 >= 0.0 && d5 <= d6) return c.squaredNorm();
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return (a + d2 / (d2 - d6) * ac).squaredNorm();
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
        return (b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).squaredNorm();
    // Distance to the closest point: the plane of a nearly degenerate triangle is only rounding noise.
    const double sum = va + vb + vc;
    return (a + vb / sum * ab + vc / sum * ac).squaredNorm();
}

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
        // Any triangle within a quarter of the limit will do: the closest one makes no better mesh.
        const double enough = 0.0625 * limit2;
        double best = kInfinity;
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

Witness farther_witness(const CollapseMesh& mesh, const Vec3& place, std::span<const MovedTriangle> moved,
                        const Vec3& first, const Vec3& second, double enough2) {
    const auto distance2 = [&](const Vec3& p) {
        double best = kInfinity;
        for (std::size_t k = 0; k < moved.size() && !(best <= enough2); ++k)
            best = std::min(best, distance2_to_triangle(place - p, mesh.position(moved[k].u) - p,
                                                        mesh.position(moved[k].w) - p));
        return best;
    };
    const double to_first = distance2(first), to_second = distance2(second);
    return to_second > to_first ? Witness{second, to_second} : Witness{first, to_first};
}

void RecentDistances::add(double distance2) {
    constexpr double kMemory = 1024.0;
    count = std::min(count + 1.0, kMemory);
    mean2 += (distance2 - mean2) / count;
}

double RecentDistances::limit2() const {
    // On a rough surface few are farther than kOutlier times the rms; less than kLeast is rounding.
    constexpr double kOutlier = 2.5, kLeast = 1e-5, kEnough = 200.0;
    return count < kEnough ? kInfinity : std::max(kOutlier * kOutlier * mean2, kLeast * kLeast);
}

}  // namespace sidewall::simplify
