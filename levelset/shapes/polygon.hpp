#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/infinity.hpp"

namespace sidewall::levelset {

/// Corners in the plane, in either orientation; the last is joined to the first.
using Polygon = std::vector<std::array<double, 2>>;

/// The polygon without corners equal to the one before.
Polygon distinct(Polygon polygon);

/// Moves a polygon by the vector \p way.
void move_by(Polygon& polygon, const std::array<double, 2>& way);

/// Squared distance of a point from the edge from \p a to \p b.
double squared_distance(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y);

/// Whether a ray from a point towards greater x crosses the edge from \p a to \p b.
bool crosses(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y);

/// Signed distance of a point in the plane from the area that lies within an odd number of \p polygons,
/// negative in it. +infinity without polygons. O(corners).
double signed_distance(std::span<const Polygon> polygons, double x, double y);

/// A tree over polygons for distances at many points: the same bits as signed_distance(), in time logarithmic
/// in the number of corners instead of linear.
class PolygonIndex {
  public:
    /// O(n log n) in the corners.
    explicit PolygonIndex(std::span<const Polygon> polygons);

    /// signed_distance() of all polygons. Safe to call in parallel.
    double signed_distance(double x, double y) const;

  private:
    using Edge = std::array<std::array<double, 2>, 2>;
    // A node of a binary tree that splits edges at the median of their centres. The left child follows its
    // parent.
    struct Node {
        std::uint32_t first = 0, last = 0;                                              // edges
        std::uint32_t right = 0;                                                        // child; 0: a leaf
        std::array<double, 2> low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};  // box of the edges
    };
    void build(std::uint32_t first, std::uint32_t last);
    template <class Away, class Reach, class Visit>
    void visit(const Away& away, const Reach& reach, const Visit& visit) const;

    std::vector<Edge> edges_;  // in the order of the leaves
    std::vector<Node> nodes_;
    double rounding_ = 0.0;  // a bound of the rounding of distances between such coordinates
};

}  // namespace sidewall::levelset
