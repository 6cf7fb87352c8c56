#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/shapes/polygon.hpp"

namespace sidewall::levelset {

/// A rectangle along the axes.
struct Rectangle {
    std::array<double, 2> low{}, high{};
};

/// Rectangles in a binary tree, halved at the median of their centres.
struct RectangleTree {
    struct Node {
        Rectangle box;  ///< around all below
        std::uint32_t first = 0,
                      last = 0;  ///< of `items` if a leaf; else first is 0 and last the right child
        bool leaf = true;
    };
    std::vector<Node> nodes;           ///< the left child follows its parent
    std::vector<std::uint32_t> items;  ///< numbers of the rectangles
};

/// Polygons to measure the distance from at many points: the bits of signed_distance(), in the logarithm of the
/// number of corners instead of the number.
class PolygonIndex {
  public:
    /// O(n log n) in the corners.
    explicit PolygonIndex(std::span<const Polygon> polygons);

    /// signed_distance() of all polygons. Safe to call in parallel.
    double signed_distance(double x, double y) const;

  private:
    std::vector<std::array<std::array<double, 2>, 2>> edges_;
    RectangleTree tree_;
    double rounding_ = 0.0;  ///< what distances of coordinates this large are rounded by, and more
};

}  // namespace sidewall::levelset
