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

/// The surface, the box in which particles fly, and the rounding of positions. Lengths in world units.
struct Geometry {
    const TriangleMesh& mesh;
    const surface::RayScene& scene;
    LateralBox box;
    double top = 0.0;     ///< height of the source plane; a particle above it has escaped
    double bottom = 0.0;  ///< height below the surface; a particle that gets there slipped through it
    double skin = 0.0;    ///< length that single precision resolves safely anywhere on the surface
    /// The surface is a 2-D profile, equal at all y: particles fly at fixed y, in the plane of x and z.
    bool straight = false;
    std::shared_ptr<const Revolution> revolution = {};  ///< set for an axial box, where positions have y = 0
};

/// Derives top, bottom and skin from the mesh. \throws GeometryError as require_traceable.
Geometry make_geometry(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box);

/// A particle at the start of a flight. The direction has unit length and points away from triangle `from`.
struct Particle {
    Vec3 position, direction;
    std::uint32_t from =
        surface::kNoTriangle;  ///< triangle that it leaves; being flat, this cannot be hit next
};

enum class FlightEnd { hit, escaped, leaked, collided };

/// The end of a flight, and where it hit.
struct Flight {
    FlightEnd end = FlightEnd::leaked;
    std::uint32_t triangle = surface::kNoTriangle;
    double u = 0.0, v = 0.0;     ///< barycentric weights of the second and third vertex
    Vec3 direction;              ///< of arrival, after all sides
    std::uint32_t segments = 0;  ///< number of ray-scene intersections
    bool rescued = false;        ///< rounding put it behind the surface; counted as a hit
};

/// Follows a particle through side planes until it hits the surface or leaves. O(log n) a segment.
/// Thread-safe.
///
/// Each ray ends at a side plane, where the flight continues mirrored or wrapped. Rounding stays within a
/// skin: flights start a skin above the surface, and rays reach a little over the sides, where there is no
/// surface. A particle that still meets a triangle's back near an edge counts as a hit there. One that meets
/// a back elsewhere, or the bottom (if no side is open; else it has escaped), counts as a hit on the surface
/// nearest to where it started or last crossed a side, if within the rounding. Otherwise it escaped past the
/// rim (box.rim_inside) or leaked: the mesh has a hole.
/// \param free_path  length, through sides, after which it collides with the gas unless it hits before.
Flight fly(const Geometry& geometry, Particle particle,
           double free_path = std::numeric_limits<double>::infinity());

/// The end of a flight past a surface of revolution, with position and direction turned into the plane y = 0.
struct RoundFlight {
    FlightEnd end = FlightEnd::leaked;
    std::uint32_t segment = RingHit::kNone;
    double along = 0.0;         ///< position on the segment, as in RingHit
    Vec3 point, direction;      ///< where it hit or collided, and its direction of arrival
    double length = 0.0;        ///< of the path flown
    std::uint32_t flights = 0;  ///< straight pieces: one more than its hits on the cylindrical mirror
    bool rescued = false;       ///< as in Flight
};

/// fly() in an axial box. Its outer side reverses the radial part of the direction only: a path that circles
/// near it goes on circling.
/// \param geometry  with its revolution set.
RoundFlight fly_round(const Geometry& geometry, const Vec3& position, const Vec3& direction,
                      double free_path = std::numeric_limits<double>::infinity());

/// How a ray that hits nothing leaves the domain.
struct DomainExit {
    bool to_source = false;  ///< through the source plane, not through an open side
    double length = 0.0;     ///< to the source plane
    Vec3 end;                ///< on the source plane, on the path unfolded through all sides
};

/// \param start, direction  of the ray before it crossed any side.
DomainExit domain_exit(const Geometry& geometry, const Vec3& start, const Vec3& direction);

/// The first hit of a ray that continues through sides; none if it rises above the surface, leaves through an
/// open side or crosses 10,000 sides.
/// \param position  in the box or on its sides.
surface::RayHit first_hit(const surface::RayScene& scene, const LateralBox& box, Vec3 position, Vec3 path);

/// Whether the source is visible in direction \p path: the ray, continued through sides, rises above the
/// surface or leaves through an open side without a hit. One that crosses 10,000 sides counts as hidden.
/// \param position  off the surface, in the box or on its sides.
bool sees_source(const surface::RayScene& scene, const LateralBox& box, Vec3 position, Vec3 path);

/// Bit k: whether the source is visible along path k, for at most RayPacket::kRays directions, in any
/// geometry; if that is straight, they lie in the plane of x and z.
std::uint32_t sees_source(const Geometry& geometry, const Vec3& position, std::span<const Vec3> paths);

/// Outward unit normal of the triangle, double precision; the zero vector if it has no area.
Vec3 outward_normal(const Geometry& geometry, std::uint32_t triangle);

/// The point that a flight hit, on the triangle as the scene has it: vertices rounded to float.
Vec3 hit_point(const Geometry& geometry, const Flight& flight);

/// How far rays reach over side planes, and the longest slip through the surface; in skins.
constexpr double kOverlap = 8.0;
/// Least cosine of a hit from behind: at more grazing incidence its sign is rounding.
constexpr double kGrazing = 1e-4;

}  // namespace sidewall::flux
