#include "levelset/shapes/polygon.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sidewall::levelset {

Polygon distinct(Polygon polygon) {
    polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
    while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
    return polygon;
}

void move_by(Polygon& polygon, const std::array<double, 2>& way) {
    for (auto& corner : polygon)
        for (std::size_t a = 0; a < 2; ++a) corner[a] += way[a];
}

double squared_distance(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y) {
    const auto [ax, ay] = a;
    const auto [bx, by] = b;
    const double ex = bx - ax, ey = by - ay, length = ex * ex + ey * ey;
    const double t = length > 0.0 ? std::clamp(((x - ax) * ex + (y - ay) * ey) / length, 0.0, 1.0) : 0.0;
    const double dx = x - ax - t * ex, dy = y - ay - t * ey;
    return dx * dx + dy * dy;
}

bool crosses(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y) {
    return (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
}

double signed_distance(std::span<const Polygon> polygons, double x, double y) {
    double squared = kInfinity;
    bool inside = false;
    for (const Polygon& polygon : polygons)
        for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++) {
            squared = std::min(squared, squared_distance(polygon[j], polygon[k], x, y));
            inside ^= crosses(polygon[j], polygon[k], x, y);
        }
    return inside ? -std::sqrt(squared) : std::sqrt(squared);
}

PolygonIndex::PolygonIndex(std::span<const Polygon> polygons) {
    for (const Polygon& polygon : polygons)
        for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++) {
            edges_.push_back({polygon[j], polygon[k]});
            for (const double x : polygon[k]) rounding_ = std::max(rounding_, 1e-12 * std::abs(x));
        }
    if (!edges_.empty()) build(0, static_cast<std::uint32_t>(edges_.size()));
}

void PolygonIndex::build(std::uint32_t first, std::uint32_t last) {
    constexpr std::uint32_t kLeaf = 8;
    const std::size_t at = nodes_.size();
    Node node{first, last};
    for (std::uint32_t e = first; e < last; ++e)
        for (const auto& corner : edges_[e])
            for (std::size_t a = 0; a < 2; ++a) {
                node.low[a] = std::min(node.low[a], corner[a]);
                node.high[a] = std::max(node.high[a], corner[a]);
            }
    nodes_.push_back(node);
    if (last - first <= kLeaf) return;
    const std::size_t axis = node.high[0] - node.low[0] > node.high[1] - node.low[1] ? 0 : 1;
    const std::uint32_t middle = first + (last - first) / 2;
    std::nth_element(
        edges_.begin() + first, edges_.begin() + middle, edges_.begin() + last,
        [axis](const Edge& e, const Edge& f) { return e[0][axis] + e[1][axis] < f[0][axis] + f[1][axis]; });
    build(first, middle);
    nodes_[at].right = static_cast<std::uint32_t>(nodes_.size());
    build(middle, last);
}

// Visits the edges of all leaves whose distance \p away is at most the current \p reach(), near ones first.
template <class Away, class Reach, class Visit>
void PolygonIndex::visit(const Away& away, const Reach& reach, const Visit& visit) const {
    // Halving 2^32 edges takes 32 levels, each of which leaves a node open.
    std::array<std::pair<double, std::uint32_t>, 64> open;
    std::size_t count = 0;
    if (!nodes_.empty()) open[count++] = {away(nodes_[0]), 0};
    while (count > 0) {
        const auto [distance, n] = open[--count];
        if (distance > reach()) continue;
        const Node& node = nodes_[n];
        if (node.right == 0) {
            for (std::uint32_t e = node.first; e < node.last; ++e) visit(edges_[e]);
            continue;
        }
        std::pair<double, std::uint32_t> left{away(nodes_[n + 1]), n + 1},
            right{away(nodes_[node.right]), node.right};
        if (left.first < right.first) std::swap(left, right);
        open[count++] = left;
        open[count++] = right;
    }
}

double PolygonIndex::signed_distance(double x, double y) const {
    double squared = kInfinity;
    visit(
        [&](const Node& node) {
            return std::hypot(std::max({node.low[0] - x, 0.0, x - node.high[0]}),
                              std::max({node.low[1] - y, 0.0, y - node.high[1]}));
        },
        [&] { return std::sqrt(squared) * (1.0 + 1e-9) + rounding_; },
        [&](const Edge& edge) { squared = std::min(squared, squared_distance(edge[0], edge[1], x, y)); });
    // Nodes that a ray towards greater x may meet count as 0 away, all others as infinitely far.
    bool inside = false;
    visit(
        [&](const Node& node) {
            return y < node.low[1] || y > node.high[1] || x > node.high[0] + rounding_ ? kInfinity : 0.0;
        },
        [] { return 0.0; }, [&](const Edge& edge) { inside ^= crosses(edge[0], edge[1], x, y); });
    return inside ? -std::sqrt(squared) : std::sqrt(squared);
}

}  // namespace sidewall::levelset
