#pragma once
#include <array>
#include <string>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// All points p with normal . p = offset; world units, the normal need not have length one.
struct Plane {
    Vec3 normal = Vec3::UnitY();
    double offset = 0.0;
};

/// Reads "y=0", "x=-1.5", "z=2".
/// \throws RecipeError for anything else.
Plane parse_plane(const std::string& text);

/// Points in order along a cut.
struct Polyline {
    std::vector<Vec3> points;              ///< a closed one does not repeat its first point
    std::vector<std::uint32_t> triangles;  ///< the mesh's, one a segment
    bool closed = false;
};

/// Profile of a surface: where it meets a plane, joined into polylines through the edges the triangles share.
///
/// A vertex exactly on the plane counts as above it, or as below where the mesh has none below (symbolic perturbation), so
/// that every cut of a closed mesh closes and either side of a domain is cut as the inside is; a triangle lying in the
/// plane adds nothing. With normals out of the
/// material, the material lies to the left of each line seen from the tip of the plane's normal.
///
/// \throws GeometryError if the plane's normal is zero or not finite.
/// \note O(n); the order follows the mesh, open lines first.
std::vector<Polyline> cut_by_plane(const TriangleMesh& mesh, const Plane& plane);

/// Two unit axes in the plane, (a, b): for y = const they are x and z, for x = const y and z, for z = const x
/// and y; for any other plane a is horizontal and b points up.
std::array<Vec3, 2> plane_axes(const Plane& plane);

/// Polylines as CSV: a header such as `x,z,polyline`, then a row a point, nine digits; closed lines repeat
/// their first point at the end.
std::string profile_csv(const std::vector<Polyline>& polylines, const Plane& plane);

}  // namespace sidewall::surface
