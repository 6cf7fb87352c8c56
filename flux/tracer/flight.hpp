#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "flux/lateral.hpp"
#include "flux/revolution.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// The surface, the box that particles fly in, and its rounding. Lengths in world units.
struct Geometry {
    const TriangleMesh& mesh;
    const surface::RayScene& scene;
    LateralBox box;
    double top = 0.0;     ///< height of the source plane; a particle above it has escaped
    double bottom = 0.0;  ///< below the surface; a particle that gets there slipped through
    double skin = 0.0;    ///< distance that single precision resolves safely anywhere on the surface
    /// The surface is a profile, the same at all y and periodic: particles fly in the plane of x and z, their y stays.
    bool straight = false;
    std::shared_ptr<const Revolution> revolution = {};  ///< of an axial box, in which positions have y = 0
};

/// \throws GeometryError as require_traceable.
Geometry make_geometry(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box);

/// A particle at the start of a flight. Direction of unit length, pointing off \p from.
struct Particle {
    Vec3 position, direction;
    std::uint32_t from =
        surface::kNoTriangle;  ///< the triangle it leaves, which is flat and cannot be hit at once
};

enum class FlightEnd { hit, escaped, leaked, collided };

/// The end of a flight, and the place that it hit.
struct Flight {
    FlightEnd end = FlightEnd::leaked;
    std::uint32_t triangle = surface::kNoTriangle;
    double u = 0.0, v = 0.0;     ///< barycentric weights of the second and third vertex
    Vec3 direction;              ///< it arrives in, after all sides
    std::uint32_t segments = 0;  ///< ray-scene intersections it took
    bool rescued = false;        ///< it hit the surface from behind by rounding, which counts as a hit
};

/// Follows a particle through side planes until it hits the surface or leaves. O(log n) a segment.
/// Thread-safe.
///
/// Side planes bound the ray, which then goes on mirrored or wrapped. All rounding happens within a skin:
/// flights start a skin above the surface, and rays reach a little over the sides, where there is no surface.
/// A particle that nevertheless hits the back of a triangle, or the bottom, arrives there if that is at the
/// triangle's rim, else at the surface nearest to where it started or last crossed a side, if one is within
/// the rounding. If neither, it came past the rim and has escaped if the box has one inside, else it has leaked,
/// which means that the mesh has a hole.
/// \param free_path  it collides if it gets this far, through sides, without a hit.
Flight fly(const Geometry& geometry, Particle particle,
           double free_path = std::numeric_limits<double>::infinity());

/// The end of a flight past a surface of revolution, turned with what flies into the plane y = 0.
struct RoundFlight {
    FlightEnd end = FlightEnd::leaked;
    std::uint32_t segment = RingHit::kNone;
    double along = 0.0;         ///< of the segment
    Vec3 point, direction;      ///< where it hit or collided, and the direction it arrives in
    double length = 0.0;        ///< of the way
    std::uint32_t flights = 0;  ///< one more than the times it met the mirror around
    bool rescued = false;       ///< as of Flight
};

/// fly() in an axial box. Mirrors turn paths, so that what goes round within the cylinder stays there.
/// \param geometry  has its revolution.
RoundFlight fly_round(const Geometry& geometry, const Vec3& position, const Vec3& direction,
                      double free_path = std::numeric_limits<double>::infinity());

/// The exit of a ray that hits nothing from the domain.
struct DomainExit {
    bool to_source = false;  ///< through the source plane, not past an open side
    double length = 0.0;     ///< to the plane
    Vec3 end;                ///< on the plane, on the straight path through all sides
};

/// \param start, direction  of the ray before any side it crossed.
DomainExit domain_exit(const Geometry& geometry, const Vec3& start, const Vec3& direction);

/// Whether the source is in line of sight: a straight \p path from \p position goes on through sides and rises above the
/// surface, or leaves through an open side, without a hit. One that crosses 10,000 sides before counts as hidden.
/// \param position  off the surface, in the box or on its sides.
bool sees_source(const surface::RayScene& scene, const LateralBox& box, Vec3 position, Vec3 path);

/// Like sees_source, along each of at most RayPacket::kRays paths from one place, for any geometry, whose paths lie in the
/// plane if it is straight; bit k is path k's.
std::uint32_t sees_source(const Geometry& geometry, const Vec3& position, std::span<const Vec3> paths);

/// Outward unit normal of the triangle, double precision; the zero vector if it has no area.
Vec3 outward_normal(const Geometry& geometry, std::uint32_t triangle);

/// The point of a flight, on the triangle that the scene sees.
Vec3 hit_point(const Geometry& geometry, const Flight& flight);

/// Rays reach this far over side planes, and a slip through the surface is at most this long; in skins.
constexpr double kOverlap = 8.0;
/// A triangle is hit from behind only beyond this cosine: at grazing incidence rounding decides the sign.
constexpr double kGrazing = 1e-4;

}  // namespace sidewall::flux
