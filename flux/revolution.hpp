#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

// Round profiles: a curve in r >= 0 and z whose revolution about the z axis is the surface. What particles
// and areas need of it stands here. A mesh holds it as a thin sector around y = 0, x being r: every segment
// of the curve is a trapezoid as wide as its r asks, so that areas are those of the revolution times one
// factor, and normals lie in the plane of x and z.
//
//     a1 ------- b1     vertices 2 i and 2 i + 1 are twins, the ends of the same ring
//      |      /   |
//      |   /      |     triangles 2 k = (a0, b0, b1) and 2 k + 1 = (a0, b1, a1) are the segment from a to b
//     a0 ------- b0
namespace sidewall::flux {

/// The sector of a strip.
///
/// \param strip   vertices and triangles as above, the twins at the same x, at least 0, and z.
/// \param radius  at which the sector is as wide as the strip.
/// \param width   the strip's along y.
/// \returns a mesh of the same triangles. At the axis it is 1e-6 of \p width wide, so that all triangles have an area.
/// \throws GeometryError unless the vertices are twins.
TriangleMesh sector_of(const TriangleMesh& strip, double radius, double width);

/// The wedges of a sector: both ends of a ring are one. The twins' own wedges stay, without triangles and area.
/// \param wedges  from make_wedges of the sector.
void join_rings(const TriangleMesh& sector, Wedges& wedges);

/// Gives both ends of each ring the flux of the ring: join_rings counts it at the first alone.
void share_rings(FluxField& by_vertex);

/// Takes the noise of the innermost rings, which are small, out of \p smooth: where the profile leaves the axis
/// without a crease, the flux of the inner two thirds of the rings up to the next one or a wall, 12 at most, moves towards the
/// parabola a + b r^2 that fits \p by_wedge there by least squares, rings weighted by area, which keeps the sum of
/// what arrives. It moves by the share sigma^2 / (sigma^2 + tau^2) as in smoothed_flux: sigma is the rings' mean error,
/// tau \p resolution times the parabola's mean, so that sharp fluxes stay as they are.
/// \pre the source is broad: deep in a hole under a narrow one the flux is no parabola.
/// \param wedges   joined by join_rings.
/// \param smooth   from smoothed_flux, by wedge.
void smooth_about_axis(const TriangleMesh& sector, const Wedges& wedges, const FluxField& by_wedge,
                       std::vector<double>& smooth, double resolution = 0.02);

/// Gives both triangles of each segment the flux of the whole segment: flights hit the first alone.
void share_segments(const TriangleMesh& sector, FluxField& by_triangle);

/// What a straight path past a surface of revolution meets first.
struct RingHit {
    static constexpr std::uint32_t kNone = 0xffffffffu;
    std::uint32_t segment = kNone;
    double distance = std::numeric_limits<double>::infinity();  ///< in units of the direction's length
    double along = 0.0;  ///< from the segment's first end, 0, to its second, 1
    explicit operator bool() const { return segment != kNone; }
};

/// A surface of revolution, and a hierarchy of boxes in r and z over its segments, which are frusta of cones: a ray meets
/// one where a quadratic in its length is 0. Double precision; const calls may run in parallel.
class Revolution {
  public:
    /// \throws GeometryError unless the triangles are those of a sector. O(n log n).
    explicit Revolution(const TriangleMesh& sector);

    /// The nearest front, seen against its outward normal, along origin + t direction, 0 < t <= reach. Backs are passed: a
    /// start that rounding has put behind the surface comes out again, and a concave frustum is met at its far side.
    /// O(log n).
    RingHit closest_front(const Vec3& origin, const Vec3& direction, double reach) const;

    /// The segment nearest to \p point, within \p reach. O(n): for the few paths that slip through.
    RingHit nearest(const Vec3& point, double reach) const;

    /// Outward unit normal in the plane of x and z.
    Vec3 normal(std::uint32_t segment) const;

  private:
    static constexpr std::size_t kChildren = 8;
    struct Segment {
        double r, z, dr, dz, nr, nz;
        double plane;           // nr r + nz z on it
        double inverse_square;  // of its length
        double slack;           // how far beyond its ends it reaches, as a share of it
    };
    // Boxes in r^2 and z; a child is a node, or ~segment.
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

/// A point turned about the axis into the plane y = 0, x at least 0.
struct Turned {
    Vec3 point, direction;
};

/// Turns \p point there, and \p direction with it.
Turned turned_into_plane(const Vec3& point, const Vec3& direction);

/// The way from \p point, within the cylinder of \p radius, to that cylinder; infinite along the axis.
double way_to_cylinder(const Vec3& point, const Vec3& direction, double radius);

}  // namespace sidewall::flux
