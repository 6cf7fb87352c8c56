#pragma once
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The body of revolution of a round wafer's profile, with flat facets between half-planes at equal angles.
///
/// \param strip  a saved surface of a round wafer: x is the radius; the profile is its boundary at lowest y.
/// \param sides  number of half-planes, at least 3. The volume is too small by a share of 6.6 / sides^2.
/// \returns a mesh with the triangle attributes of \p strip. O(sides x points of the profile).
TriangleMesh revolved(const TriangleMesh& strip, int sides);

/// Area, in length^2, of the full surface of revolution that \p strip stands for.
double revolved_area(const TriangleMesh& strip);

}  // namespace sidewall::app
