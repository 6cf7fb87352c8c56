#pragma once
#include <functional>

#include "levelset/domain.hpp"
#include "levelset/shapes.hpp"

namespace sidewall::levelset {

/// Signed distance in the plane, negative inside; world units. Safe to call in parallel.
using Outline = std::function<double(double x, double y)>;

/// The nearest repetition of an offset from a shape's centre: the offset itself but on a periodic axis (0 = x, 1 = y).
double wrapped(double offset, const Domain& domain, int axis);

/// What \p shape outlines, seen from above: the polygons of a mask, the width of a trench, the circle of a hole, the
/// rectangle of a box; without `openings` all but these. It repeats on periodic axes.
/// \throws GeometryError for another shape, or a polygon over 1000 times as wide as a periodic domain.
Outline outline(const Shape& shape, const Domain& domain);

}  // namespace sidewall::levelset
