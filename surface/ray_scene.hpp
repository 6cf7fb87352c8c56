#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "surface/triangle_mesh.hpp"

struct RTCSceneTy;

namespace sidewall::surface {

constexpr std::uint32_t kNoTriangle = 0xffffffffu;

/// Where a ray meets the surface, or the surface point nearest to a query.
struct SurfaceHit {
    std::uint32_t triangle = kNoTriangle;
    double distance = 0.0;  ///< along the ray in units of its direction's length, or to the query point
    double u = 0.0;         ///< barycentric weight of the triangle's second vertex
    double v = 0.0;         ///< barycentric weight of the triangle's third vertex
    Vec3 point = Vec3::Zero();
    explicit operator bool() const { return triangle != kNoTriangle; }
};

/// The one wrapper around Embree: a bounding volume hierarchy over a mesh, for closest hits and closest
/// points. Queries are const and may run in parallel. The mesh is copied in single precision.
class RayScene {
  public:
    enum class Quality { medium, high };
    /// Builds the hierarchy in parallel; O(n log n).
    /// \throws GeometryError if the mesh has no triangle.
    explicit RayScene(const TriangleMesh& mesh, Quality quality = Quality::medium);
    ~RayScene();
    RayScene(RayScene&&) noexcept;
    RayScene& operator=(RayScene&&) noexcept;

    /// Nearest hit of the ray origin + t direction, t in [t_min, t_max]; no triangle if it hits nothing.
    SurfaceHit closest_hit(const Vec3& origin, const Vec3& direction, double t_min, double t_max) const;

    /// Whether anything lies on the segment t in [t_min, t_max].
    bool occluded(const Vec3& origin, const Vec3& direction, double t_min, double t_max) const;

    /// Surface point nearest to \p query within \p radius (computed in double precision on the original
    /// vertices); no triangle if none is that near.
    SurfaceHit closest_point(const Vec3& query, double radius) const;

    /// The mesh as it was given, in double precision.
    std::span<const Vec3> vertices() const;
    std::span<const Triangle> triangles() const;

    /// z of the highest vertex.
    double top() const;

    /// Embree's own scene, for loops that trace packets. Robust flag set. Geometry id 0, primitive =
    /// triangle.
    RTCSceneTy* handle() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Closest point of the triangle a, b, c to p and its barycentric weights (of b and c). Ericson, Real-Time
/// Collision Detection, 2005, section 5.1.5. Degenerate triangles are handled.
SurfaceHit closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace sidewall::surface
