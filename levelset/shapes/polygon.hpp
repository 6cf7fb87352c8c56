#pragma once
#include <array>
#include <span>
#include <vector>

namespace sidewall::levelset {

/// Corners in the plane, in order, either way round; the last is joined to the first.
using Polygon = std::vector<std::array<double, 2>>;

/// The polygon without corners that repeat the one before.
Polygon distinct(Polygon polygon);

/// Moves a polygon.
void move_by(Polygon& polygon, const std::array<double, 2>& way);

/// Squared distance of a point from the edge from \p a to \p b.
double squared_distance(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y);

/// Whether a ray from a point towards greater x crosses the edge from \p a to \p b.
bool crosses(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y);

/// Signed distance of a point in the plane from the area that lies within an odd number of \p polygons, negative in it.
/// +infinity without polygons. O(corners).
double signed_distance(std::span<const Polygon> polygons, double x, double y);

}  // namespace sidewall::levelset
