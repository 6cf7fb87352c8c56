#include "levelset/shapes/polygon_index.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "surface/infinity.hpp"

namespace sidewall::levelset {
namespace {

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
    if (!tree.nodes.empty()) open[count++] = 0;
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

}  // namespace

PolygonIndex::PolygonIndex(std::span<const Polygon> polygons) {
    std::vector<Rectangle> boxes;
    for (const Polygon& polygon : polygons)
        for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++) {
            edges_.push_back({polygon[j], polygon[k]});
            boxes.push_back(around({{polygon[j], polygon[j]}, {polygon[k], polygon[k]}}));
            for (const double x : polygon[k]) rounding_ = std::max(rounding_, 1e-12 * std::abs(x));
        }
    tree_ = make_tree(boxes);
}

double PolygonIndex::signed_distance(double x, double y) const {
    double squared = kInfinity;
    visit_near(
        tree_, x, y, [&] { return std::sqrt(squared) * (1.0 + 1e-9) + rounding_; },
        [&](std::uint32_t edge) {
            squared = std::min(squared, squared_distance(edges_[edge][0], edges_[edge][1], x, y));
        });
    bool inside = false;
    visit_ray(tree_, x, y, rounding_,
              [&](std::uint32_t edge) { inside ^= crosses(edges_[edge][0], edges_[edge][1], x, y); });
    return inside ? -std::sqrt(squared) : std::sqrt(squared);
}

}  // namespace sidewall::levelset
