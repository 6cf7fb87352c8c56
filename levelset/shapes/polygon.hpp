#pragma once
#include <array>
#include <vector>

namespace sidewall::levelset {

/// Corners in the plane, in order, either way round; the last is joined to the first.
using Polygon = std::vector<std::array<double, 2>>;

/// Squared distance of a point from the edge from \p a to \p b.
double squared_distance(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y);

/// Whether a ray from a point towards greater x crosses the edge from \p a to \p b.
bool crosses(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y);

/// Signed distance of a point from a polygon: the term of the union below.
double polygon_distance(const Polygon& polygon, double x, double y);

/// Signed distance of a point in the plane from the union of \p polygons, negative inside: exact outside, and
/// inside where they do not overlap; else a bound. Even-odd for a polygon that crosses itself. +infinity
/// without polygons. O(corners).
double signed_distance(const std::vector<Polygon>& polygons, double x, double y);

}  // namespace sidewall::levelset
