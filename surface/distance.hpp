#pragma once
#include <array>
#include <vector>

#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Distances from the vertices of one mesh to the surface of another, in the meshes' length unit.
struct Distance {
    double max = 0.0;
    double mean = 0.0;  ///< over the vertices, unweighted
    std::vector<double> per_vertex;
};

/// Distance from every vertex of \p from to the closest point of \p to, found in parallel and computed in
/// double precision. The sum runs in vertex order, so that the result does not depend on threads. Vertices
/// that no triangle uses get the distance 0 and do not enter the mean. A mesh \p from without triangles is a
/// set of points.
///
/// \throws GeometryError if \p from has no vertex or \p to no triangle.
/// \note Each search is bounded by the distance to the previous vertex's closest point: fast if vertices lie
///       in spatial order.
Distance distance(const TriangleMesh& from, const TriangleMesh& to);

/// distance() to a mesh whose ray scene exists already.
Distance distance(const TriangleMesh& from, const RayScene& to);

/// Distances between two surfaces in both directions.
struct TwoSidedDistance {
    Distance forward;   ///< vertices of the first mesh to the surface of the second
    Distance backward;  ///< vertices of the second mesh to the surface of the first
    double max = 0.0;   ///< greater of the two maxima: the Hausdorff distance sampled at vertices
    double mean = 0.0;  ///< greater of the two means
};

TwoSidedDistance two_sided_distance(const TriangleMesh& first, const TriangleMesh& second);

/// Signed distance to a surface at a point, negative behind its triangles.
struct DistanceSample {
    double distance = 0.0;
    Vec3 rise = Vec3::Zero();  ///< gradient of the distance, unit length; on the surface the normal there
    SurfaceHit nearest;
};

/// Signed distance to a mesh. Its sign comes from the angle-weighted normal of the face, edge or vertex with
/// the closest point (Baerentzen and Aanaes, IEEE TVCG 11, 2005). Exact for a closed manifold and, at points
/// between the sides, for one that ends on the sides of a rectangle. Queries are const and thread-safe.
class SignedDistance {
  public:
    /// Builds the scene and the normals, O(n log n).
    /// \throws GeometryError if the mesh has no triangle.
    explicit SignedDistance(const TriangleMesh& mesh);

    /// \param point   world units.
    /// \param radius  radius of the first search for the closest point. A known upper bound of the distance
    ///                makes the search faster; the result does not depend on it.
    /// \throws GeometryError if the coordinates are beyond what Embree takes, about 1e18.
    DistanceSample at(const Vec3& point, double radius = 1e30) const;

    const RayScene& scene() const { return scene_; }

  private:
    RayScene scene_;
    std::vector<Vec3> face_, vertex_;
    std::vector<std::array<Vec3, 3>> edge_;  // per triangle, edge k from corner k to k + 1
};

}  // namespace sidewall::surface
