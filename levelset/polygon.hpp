#pragma once
#include <array>
#include <vector>

namespace sidewall::levelset {

/// Corners in the plane, in order, either way round; the last is joined to the first.
using Polygon = std::vector<std::array<double, 2>>;

/// Signed distance of a point in the plane from the union of \p polygons, negative inside: exact outside, and
/// inside where they do not overlap; else a bound. Even-odd for a polygon that crosses itself. +infinity
/// without polygons. O(corners).
double signed_distance(const std::vector<Polygon>& polygons, double x, double y);

}  // namespace sidewall::levelset
