#include "levelset/shapes/polygon_index.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "surface/infinity.hpp"

namespace sidewall::levelset {
namespace {

constexpr std::size_t kFewCorners = 32;  // are measured one by one
constexpr std::uint32_t kLeaf = 8;

using Point = std::array<double, 2>;

Rectangle around(std::initializer_list<Rectangle> parts) {
    Rectangle box{{kInfinity, kInfinity}, {-kInfinity, -kInfinity}};
    for (const Rectangle& part : parts)
        for (std::size_t a = 0; a < 2; ++a) {
            box.low[a] = std::min(box.low[a], part.low[a]);
            box.high[a] = std::max(box.high[a], part.high[a]);
        }
    return box;
}

Rectangle around(const Polygon& polygon) {
    Rectangle box{{kInfinity, kInfinity}, {-kInfinity, -kInfinity}};
    for (const Point& p : polygon) box = around({box, {p, p}});
    return box;
}

std::uint32_t build(RectangleTree& tree, const std::vector<Rectangle>& boxes, std::uint32_t first,
                    std::uint32_t last) {
    const auto node = static_cast<std::uint32_t>(tree.nodes.size());
    Rectangle box = boxes[tree.items[first]];
    for (std::uint32_t i = first; i < last; ++i) box = around({box, boxes[tree.items[i]]});
    tree.nodes.push_back({box, first, last, true});
    if (last - first <= kLeaf) return node;
    const std::size_t axis = box.high[0] - box.low[0] > box.high[1] - box.low[1] ? 0 : 1;
    const auto centre = [&](std::uint32_t i) { return boxes[i].low[axis] + boxes[i].high[axis]; };
    const std::uint32_t middle = first + (last - first) / 2;
    std::nth_element(tree.items.begin() + first, tree.items.begin() + middle, tree.items.begin() + last,
                     [&](std::uint32_t i, std::uint32_t j) {
                         return centre(i) != centre(j) ? centre(i) < centre(j) : i < j;
                     });
    build(tree, boxes, first, middle);
    tree.nodes[node].leaf = false;
    tree.nodes[node].last = build(tree, boxes, middle, last);
    return node;
}

RectangleTree make_tree(const std::vector<Rectangle>& boxes) {
    RectangleTree tree;
    tree.items.resize(boxes.size());
    std::iota(tree.items.begin(), tree.items.end(), 0u);
    if (!boxes.empty()) build(tree, boxes, 0, static_cast<std::uint32_t>(boxes.size()));
    return tree;
}

double distance(const Rectangle& box, double x, double y) {
    return std::hypot(std::max({box.low[0] - x, 0.0, x - box.high[0]}),
                      std::max({box.low[1] - y, 0.0, y - box.high[1]}));
}

// Visits the items of all leaves that lie no farther than \p reach() says at the time, near ones first.
template <class Reach, class Visit>
void visit_near(const RectangleTree& tree, double x, double y, const Reach& reach, const Visit& visit) {
    if (tree.nodes.empty()) return;
    // Halving 2^32 items takes 32 levels, each of which leaves one node behind.
    std::array<std::pair<double, std::uint32_t>, 64> open;
    std::size_t count = 0;
    open[count++] = {distance(tree.nodes[0].box, x, y), 0};
    while (count > 0) {
        const auto [away, n] = open[--count];
        if (away > reach()) continue;
        const RectangleTree::Node& node = tree.nodes[n];
        if (node.leaf) {
            for (std::uint32_t i = node.first; i < node.last; ++i) visit(tree.items[i]);
            continue;
        }
        std::pair<double, std::uint32_t> left{distance(tree.nodes[n + 1].box, x, y), n + 1},
            right{distance(tree.nodes[node.last].box, x, y), node.last};
        if (left.first < right.first) std::swap(left, right);
        open[count++] = left;
        open[count++] = right;
    }
}

// Visits the items of all leaves that a ray from the point towards greater x can meet.
template <class Visit>
void visit_ray(const RectangleTree& tree, double x, double y, double rounding, const Visit& visit) {
    std::array<std::uint32_t, 64> open;
    std::size_t count = 0;
    open[count++] = 0;
    while (count > 0) {
        const std::uint32_t n = open[--count];
        const RectangleTree::Node& node = tree.nodes[n];
        if (y < node.box.low[1] || y > node.box.high[1] || x > node.box.high[0] + rounding) continue;
        if (node.leaf) {
            for (std::uint32_t i = node.first; i < node.last; ++i) visit(tree.items[i]);
            continue;
        }
        open[count++] = node.last;
        open[count++] = n + 1;
    }
}

bool runs_clockwise(const Polygon& polygon) {
    double twice = 0.0;
    for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++)
        twice += (polygon[j][0] - polygon[0][0]) * (polygon[k][1] - polygon[0][1]) -
                 (polygon[k][0] - polygon[0][0]) * (polygon[j][1] - polygon[0][1]);
    return twice < 0.0;
}

}  // namespace

PolygonIndex::PolygonIndex(std::vector<Polygon> polygons) : polygons_(std::move(polygons)) {
    std::vector<Rectangle> boxes;
    boxes.reserve(polygons_.size());
    for (const Polygon& polygon : polygons_) {
        boxes.push_back(around(polygon));
        for (const Point& p : polygon)
            rounding_ = std::max({rounding_, 1e-12 * std::abs(p[0]), 1e-12 * std::abs(p[1])});
        std::vector<Rectangle> edges;
        if (polygon.size() > kFewCorners)
            for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++)
                edges.push_back(around({{polygon[j], polygon[j]}, {polygon[k], polygon[k]}}));
        edges_.push_back(make_tree(edges));
        clockwise_.push_back(runs_clockwise(polygon) ? 1 : 0);
    }
    tree_ = make_tree(boxes);
}

double PolygonIndex::of_polygon(std::uint32_t k, double x, double y) const {
    const Polygon& polygon = polygons_[k];
    const RectangleTree& edges = edges_[k];
    if (edges.nodes.empty()) return polygon_distance(polygon, x, y);
    const auto corner = [&](std::uint32_t edge) { return polygon[edge > 0 ? edge - 1 : polygon.size() - 1]; };
    double squared = kInfinity;
    visit_near(
        edges, x, y, [&] { return std::sqrt(squared) * (1.0 + 1e-9) + rounding_; },
        [&](std::uint32_t edge) {
            squared = std::min(squared, squared_distance(corner(edge), polygon[edge], x, y));
        });
    bool inside = false;
    visit_ray(edges, x, y, rounding_,
              [&](std::uint32_t edge) { inside ^= crosses(corner(edge), polygon[edge], x, y); });
    return inside ? -std::sqrt(squared) : std::sqrt(squared);
}

double PolygonIndex::signed_distance(double x, double y) const {
    double nearest = kInfinity;
    // Only a polygon whose rectangle holds the point can be nearer than one that the point is in.
    visit_near(
        tree_, x, y, [&] { return std::max(nearest, 0.0) * (1.0 + 1e-9) + rounding_; },
        [&](std::uint32_t k) { nearest = std::min(nearest, of_polygon(k, x, y)); });
    return nearest;
}

double PolygonIndex::oriented_distance(double x, double y) const {
    double nearest = kInfinity, signed_one = kInfinity;
    // The way to the nearest of all boundaries crosses no other.
    visit_near(
        tree_, x, y, [&] { return nearest * (1.0 + 1e-9) + rounding_; },
        [&](std::uint32_t k) {
            const double distance = of_polygon(k, x, y);
            if (std::abs(distance) >= nearest) return;
            nearest = std::abs(distance);
            signed_one = clockwise_[k] != 0 ? -distance : distance;
        });
    return signed_one;
}

}  // namespace sidewall::levelset
