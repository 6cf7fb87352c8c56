#pragma once
#include <functional>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::levelset {

/// Signed distance in the plane, negative inside; world units. Safe to call in parallel.
using Outline = std::function<double(double x, double y)>;

/// An offset from a shape's centre, on a periodic axis (0 = x, 1 = y) from the nearest of its repetitions.
double wrapped(double offset, const Domain& domain, int axis);

/// The polygons, and on periodic axes their repetitions, that lie within half an extent of the domain's box.
/// \throws GeometryError for a polygon over 1000 times as wide as a periodic domain.
std::vector<Polygon> repeated(const std::vector<Polygon>& polygons, const Domain& domain);

/// The outline of \p shape from above: the polygons of a mask, the width of a trench, the circle of a hole,
/// the rectangle of a box; without `openings`, all but these. It repeats on periodic axes.
/// \throws GeometryError for another shape, or a polygon over 1000 times as wide as a periodic domain.
Outline outline(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
