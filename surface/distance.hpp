#pragma once
#include <array>
#include <vector>

#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Distances from the vertices of one mesh to the surface of another, in the meshes' length unit.
struct Distance {
    double max = 0.0;
    double mean = 0.0;  ///< over the vertices, each counting the same
    std::vector<double> per_vertex;
};

/// Distance from every vertex of \p from to the nearest point of \p to, found in parallel and computed in
/// double precision; the sum runs in vertex order, so that the result does not depend on threads. Vertices
/// that no triangle uses are not on the surface: their distance is 0 and does not count. A mesh without
/// triangles is its points.
///
/// \throws GeometryError if \p from has no vertex or \p to no triangle.
/// \note Each search starts from the nearest point of the vertex before: cheap if vertices lie in spatial
/// order.
Distance distance(const TriangleMesh& from, const TriangleMesh& to);

/// distance() with the hierarchy of \p to at hand.
Distance distance(const TriangleMesh& from, const RayScene& to);

/// Both directions between two surfaces.
struct TwoSidedDistance {
    Distance forward;   ///< vertices of the first mesh to the surface of the second
    Distance backward;  ///< and the other way round
    double max = 0.0;   ///< greater of the two maxima: the Hausdorff distance sampled at vertices
    double mean = 0.0;  ///< greater of the two means
};

TwoSidedDistance two_sided_distance(const TriangleMesh& first, const TriangleMesh& second);

/// The distance to a surface at a point, negative behind its triangles.
struct DistanceSample {
    double distance = 0.0;
    Vec3 rise = Vec3::Zero();  ///< its gradient, of length one; on the surface the normal there
    SurfaceHit nearest;
};

/// Signed distances to a mesh: the nearest point, and the side of it by the angle-weighted normal of the face,
/// edge or corner on which it lies (Baerentzen and Aanaes, IEEE TVCG 11, 2005). Exact for a closed manifold,
/// and between the sides of a rectangle for an open one that ends on them. Queries are const and may run in
/// parallel.
class SignedDistance {
  public:
    /// O(n log n).
    /// \throws GeometryError if the mesh has no triangle.
    explicit SignedDistance(const TriangleMesh& mesh);

    /// \param point   world units.
    /// \param radius  within which the nearest point is searched first: a bound of the distance that is at hand makes
    ///                the search faster and changes nothing else.
    /// \throws GeometryError if the coordinates are beyond what Embree takes, about 1e18.
    DistanceSample at(const Vec3& point, double radius = 1e30) const;

    /// The mesh as a scene for rays.
    const RayScene& scene() const { return scene_; }

  private:
    RayScene scene_;
    std::vector<Vec3> face_, vertex_;
    std::vector<std::array<Vec3, 3>> edge_;  // per triangle, edge k from corner k to k + 1
};

}  // namespace sidewall::surface
