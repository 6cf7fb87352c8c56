#pragma once
#include <array>
#include <string>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// A plane: all points p with normal . p = offset, in world units. The normal need not have unit length.
struct Plane {
    Vec3 normal = Vec3::UnitY();
    double offset = 0.0;
};

/// Reads "y=0", "x=-1.5", "z=2".
/// \throws RecipeError for anything else.
Plane parse_plane(const std::string& text);

/// A polyline along a cut.
struct Polyline {
    std::vector<Vec3> points;              ///< a closed one does not repeat its first point
    std::vector<std::uint32_t> triangles;  ///< triangle of the mesh that each segment crosses
    bool closed = false;
};

/// Profile of a surface: its intersection with a plane, as polylines joined across shared edges.
///
/// A vertex exactly on the plane counts as above it (symbolic perturbation), or as below it if no vertex of
/// the mesh lies below. Cuts of closed meshes are therefore closed, and a cut along either side of a domain
/// yields the profile there. A triangle lying in the plane adds nothing. With normals out of the material,
/// the material lies to the left of each line seen from the tip of the plane's normal.
///
/// \throws GeometryError if the plane's normal is zero or not finite.
/// \note O(n). Polylines come in mesh order, open ones first.
std::vector<Polyline> cut_by_plane(const TriangleMesh& mesh, const Plane& plane);

/// Two orthogonal unit axes (a, b) in the plane: x and z for y = const, y and z for x = const, x and y for z
/// = const; for any other plane a is horizontal and b points up.
std::array<Vec3, 2> plane_axes(const Plane& plane);

/// Polylines as CSV: a header such as `x,z,polyline`, then one row per point with nine significant digits.
/// Closed lines repeat their first point at the end.
std::string profile_csv(const std::vector<Polyline>& polylines, const Plane& plane);

}  // namespace sidewall::surface
