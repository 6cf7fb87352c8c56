#pragma once
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The body that a round wafer's profile makes about the axis, with flat sides between half-planes at equal angles.
///
/// \param strip  a saved surface of a round wafer: x is the radius, and every point of the curve lies on its side of least y.
/// \param sides  at least 3. The volume is less than the round body's by 6.6 / sides^2 of it.
/// \returns a mesh with the strip's values by triangle. O(sides x points of the curve).
TriangleMesh revolved(const TriangleMesh& strip, int sides);

/// The area of the surface all around, length^2, that \p strip stands for.
double revolved_area(const TriangleMesh& strip);

}  // namespace sidewall::app
