#pragma once
#include <array>
#include <vector>

#include "surface/ray_scene.hpp"

namespace sidewall::surface {

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
