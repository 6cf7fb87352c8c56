#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

// Surfaces of revolution: a profile curve in r >= 0 and z, turned about the z axis. The mesh is a thin sector
// around y = 0, with x = r: every segment of the curve is a trapezoid whose width grows with r, so that areas
// are those of the whole surface times one factor, and normals lie in the plane of x and z.
//
//     a1 ------- b1     vertices 2 i and 2 i + 1 are twins: the two ends of one ring
//      |      /   |
//      |   /      |     triangles 2 k = (a0, b0, b1) and 2 k + 1 = (a0, b1, a1) form the segment from a to b
//     a0 ------- b0
namespace sidewall::flux {

/// Makes the sector from a mesh of constant width along y.
///
/// \param strip   vertices and triangles as drawn above; twins have equal x, at least 0, and equal z.
/// \param radius  where the sector is \p width wide.
/// \param width   width of \p strip along y.
/// \returns a mesh of the same triangles; at the axis 1e-6 of \p width wide, so that all have an area.
/// \throws GeometryError unless the vertices are twins.
TriangleMesh sector_of(const TriangleMesh& strip, double radius, double width);

/// Joins the wedges of the two ends of each ring. The second twin's remain, without triangles and area.
/// \param wedges  from make_wedges of the sector.
void join_rings(const TriangleMesh& sector, Wedges& wedges);

/// Copies the flux of each ring, which join_rings puts on the first twin, to the second.
void share_rings(FluxField& by_vertex);

/// Smooths the noise of the innermost rings, which are small and rarely hit.
///
/// Takes the rings from the axis to the first crease or wall, at most 18, and of these the inner two thirds.
/// Their fluxes move towards the parabola a + b r^2 that fits \p by_wedge by least squares, rings weighted by
/// area, which keeps the total that arrives. They move by the share sigma^2 / (sigma^2 + tau^2), as in
/// smoothed_flux: sigma is the rings' rms error, tau \p resolution times their mean flux.
/// \pre the source is broad: deep in a hole under a narrow source the flux is no parabola.
/// \param wedges  joined by join_rings.
/// \param smooth  from smoothed_flux, by wedge; changed in place.
void smooth_about_axis(const TriangleMesh& sector, const Wedges& wedges, const FluxField& by_wedge,
                       std::vector<double>& smooth, double resolution = 0.02);

/// Gives both triangles of each segment the segment's mean flux: flights hit the first triangle only.
void share_segments(const TriangleMesh& sector, FluxField& by_triangle);

/// The first hit of a straight path on a surface of revolution.
struct RingHit {
    static constexpr std::uint32_t kNone = 0xffffffffu;
    std::uint32_t segment = kNone;
    double distance = std::numeric_limits<double>::infinity();  ///< in units of the direction's length
    double along = 0.0;  ///< position on the segment: 0 at its first end, 1 at its second
    explicit operator bool() const { return segment != kNone; }
};

/// A surface of revolution for ray queries: a bounding volume hierarchy in r and z over its segments, which
/// are frusta of cones; a hit solves a quadratic. Double precision; const calls may run in parallel.
class Revolution {
  public:
    /// \throws GeometryError unless the triangles are those of a sector. O(n log n).
    explicit Revolution(const TriangleMesh& sector);

    /// The nearest front hit (against the outward normal) along origin + t direction, 0 < t <= reach. Back
    /// faces are passed: a start that rounding has put behind the surface comes out again, and a ray through
    /// a cone hits the inside of its far wall. O(log n).
    RingHit closest_front(const Vec3& origin, const Vec3& direction, double reach) const;

    /// The segment nearest to \p point, within \p reach. O(n): used only for the few paths that slip through.
    RingHit nearest(const Vec3& point, double reach) const;

    /// Outward unit normal of a segment in the plane of x and z.
    Vec3 normal(std::uint32_t segment) const;

  private:
    static constexpr std::size_t kChildren = 8;
    struct Segment {
        double r, z, dr, dz, nr, nz;
        double plane;           // nr r + nz z, constant along the segment
        double inverse_square;  // 1 / length^2
        double slack;           // extension beyond each end, as a share of the length
    };
    // Boxes of eight children in r^2 and z; a child is a node's index, or ~segment.
    struct alignas(64) Node {
        std::array<double, kChildren> inner, outer, low, high;
        std::array<std::int32_t, kChildren> child;
    };
    struct Ray;
    std::int32_t build(std::vector<std::uint32_t>::iterator first, std::vector<std::uint32_t>::iterator last,
                       Node& box);
    void meet(const Ray& ray, std::uint32_t segment, RingHit& best) const;

    std::vector<Segment> segments_;
    std::vector<Node> nodes_;
    std::int32_t root_ = 0;
};

/// A point turned about the axis into the plane y = 0, x at least 0, and the direction turned with it.
struct Turned {
    Vec3 point, direction;
};

/// Turns \p point into that plane, and \p direction by the same angle.
Turned turned_into_plane(const Vec3& point, const Vec3& direction);

/// Distance, in units of \p direction's length, from \p point inside a cylinder to it; infinite if vertical.
double way_to_cylinder(const Vec3& point, const Vec3& direction, double radius);

}  // namespace sidewall::flux
