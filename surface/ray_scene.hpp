#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "surface/triangle_mesh.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace sidewall::surface {

constexpr std::uint32_t kNoTriangle = 0xffffffffu;

/// A point of the surface: where a ray meets it, or the closest point to a query.
struct SurfaceHit {
    std::uint32_t triangle = kNoTriangle;
    double distance = 0.0;  ///< along the ray in units of its direction's length, or to the query point
    double u = 0.0;         ///< barycentric weight of the triangle's second vertex
    double v = 0.0;         ///< barycentric weight of the triangle's third vertex
    Vec3 point = Vec3::Zero();
    explicit operator bool() const { return triangle != kNoTriangle; }
};

/// The point at which a ray meets the surface first.
struct RayHit : SurfaceHit {
    Vec3 normal = Vec3::Zero();  ///< the triangle's, in single precision; its length is twice the area
};

/// Eight rays and the first hit of each, one array per component. The layout is that of Embree's RTCRayHit8;
/// `instance` has twice the length because Embree 4 appends a second array of instance data.
struct alignas(32) RayPacket {
    static constexpr std::size_t kRays = 8;

    float origin_x[kRays], origin_y[kRays], origin_z[kRays], t_min[kRays];
    float direction_x[kRays], direction_y[kRays], direction_z[kRays], time[kRays];
    float t_max[kRays];  ///< after a query: the hit's distance, in units of the direction's length
    std::uint32_t mask[kRays], id[kRays], flags[kRays];
    float normal_x[kRays], normal_y[kRays], normal_z[kRays];  ///< the triangle's; twice its area long
    float u[kRays], v[kRays];                                 ///< barycentric weights as in SurfaceHit
    std::uint32_t triangle[kRays];                            ///< kNoTriangle for a ray that hits nothing
    std::uint32_t geometry[kRays], instance[2 * kRays];
};

/// The only wrapper around Embree: a bounding volume hierarchy over a mesh, for closest hits and closest
/// points. Queries are const and may run in parallel. Embree works on a copy of the mesh in single precision.
class RayScene {
  public:
    /// Builds the hierarchy in parallel; O(n log n).
    /// \throws GeometryError if the mesh has no triangle.
    explicit RayScene(const TriangleMesh& mesh);

    /// Nearest hit of the ray origin + t direction, t in [t_min, t_max]; no triangle if it hits nothing.
    RayHit closest_hit(const Vec3& origin, const Vec3& direction, double t_min, double t_max) const;

    /// Nearest hits of those rays of a packet whose \p active is -1; rays with 0 are skipped. \p active is
    /// aligned to 32 bytes. The caller sets origins, directions, t_min and t_max.
    void closest_hits(const int* active, RayPacket& packet) const;

    /// Whether the segment origin + t direction, t in [t_min, t_max], meets the surface.
    bool occluded(const Vec3& origin, const Vec3& direction, double t_min, double t_max) const;

    /// occluded() for rays of a packet with \p active -1: sets t_max below 0 where they meet the surface.
    void occluded(const int* active, RayPacket& packet) const;

    /// Point of the surface closest to \p query, computed in double precision on the original vertices; no
    /// triangle if the surface is farther than \p radius.
    SurfaceHit closest_point(const Vec3& query, double radius) const;

    /// Closest point of a surface that repeats after \p period along x and y; 0: not along that axis. Its
    /// distance is that of the repeat, its `point` lies on the mesh. Of points as close, the mesh's own counts.
    SurfaceHit closest_point(const Vec3& query, double radius, const std::array<double, 2>& period) const;

    /// The mesh as it was given, in double precision.
    std::span<const Vec3> vertices() const { return vertices_; }
    std::span<const Triangle> triangles() const { return triangles_; }

    /// z of the highest vertex.
    double top() const { return top_; }

    /// The Embree scene, for benchmarks: robust, one geometry of id 0; primitive ids are triangle indices.
    RTCSceneTy* handle() const { return scene_.get(); }

  private:
    struct Release {
        void operator()(RTCDeviceTy* device) const;
        void operator()(RTCSceneTy* scene) const;
    };
    std::vector<Vec3> vertices_;
    std::vector<Triangle> triangles_;
    double top_ = 0.0;
    std::unique_ptr<RTCDeviceTy, Release> device_;
    std::unique_ptr<RTCSceneTy, Release> scene_;
};

/// Closest point of the triangle a, b, c to p and its barycentric weights (of b and c). Ericson, Real-Time
/// Collision Detection, 2005, section 5.1.5. Degenerate triangles are handled.
SurfaceHit closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace sidewall::surface
