#include "flux/tracer/flight.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "surface/infinity.hpp"

namespace sidewall::flux {
namespace {

// Skin relative to the largest coordinate: 16 times the largest error of rounding a position to float.
constexpr double kSkin = 0x1p-20;
// Most segments of a flight. One with more is caught by rounding: its particle counts as leaked.
constexpr std::uint32_t kMaxSegments = 1'000'000;

// Starts of a flight's latest segments; a slip through the surface happens at one of them.
struct Trail {
    std::array<Vec3, 8> start;
    std::uint32_t count = 0;
    void add(const Vec3& position) { start[count++ % start.size()] = position; }
};

// Whether the ray hit the triangle from behind. Embree's normal rules it out nearly always; as a sliver may
// have turned over when its vertices were rounded to float, the normal in double precision confirms it.
bool is_behind(const Geometry& geometry, const Vec3& direction, const surface::RayHit& hit) {
    return direction.dot(hit.normal) > 0.0 &&
           direction.dot(outward_normal(geometry, hit.triangle)) > kGrazing;
}

enum class SegmentHit { nothing, front, back };

// The nearest front or back face along one straight segment. Back faces within kOverlap skins of the start do
// not count: they are the far side of a fold through which the start was lifted.
SegmentHit trace_segment(const Geometry& geometry, const Particle& particle, double back_up, double reach,
                         Flight& flight) {
    const Vec3 origin = particle.position - back_up * particle.direction;
    double t_near = 0.0;
    const double t_far = reach + back_up + kOverlap * geometry.skin;
    while (true) {
        ++flight.segments;
        const surface::RayHit hit = geometry.scene.closest_hit(origin, particle.direction, t_near, t_far);
        if (!hit) return SegmentHit::nothing;
        const bool back = is_behind(geometry, particle.direction, hit);
        if (hit.triangle != particle.from && !(back && hit.distance - back_up < kOverlap * geometry.skin)) {
            flight.triangle = hit.triangle;
            flight.u = hit.u;
            flight.v = hit.v;
            return back ? SegmentHit::back : SegmentHit::front;
        }
        // Continue past the hit by more than its rounding, or the same hit might be found for ever.
        t_near = std::max(t_near, hit.distance) * (1.0 + 1e-6) + 1e-3 * geometry.skin;
        if (!(t_near < t_far)) return SegmentHit::nothing;
    }
}

// Whether a hit on a back face is so near to an edge that the ray really hit the edge: at a convex edge,
// rounding may let the far face come first.
bool hit_rim(const Geometry& geometry, const Flight& flight) {
    const auto [a, b, c] = geometry.mesh.triangles[flight.triangle];
    const std::array<Vec3, 3> p{geometry.mesh.vertices[a], geometry.mesh.vertices[b],
                                geometry.mesh.vertices[c]};
    const double twice_area = (p[1] - p[0]).cross(p[2] - p[0]).norm();
    const std::array<double, 3> weight{1.0 - flight.u - flight.v, flight.u, flight.v};
    for (std::size_t k = 0; k < 3; ++k)
        if (weight[k] * twice_area <= kOverlap * geometry.skin * (p[(k + 2) % 3] - p[(k + 1) % 3]).norm())
            return true;
    return false;
}

// Books a hit for a particle behind the surface, where it slipped through, if that is within the rounding.
void book_slip(const Geometry& geometry, const Trail& trail, Flight& flight) {
    const auto size = static_cast<std::uint32_t>(trail.start.size());
    for (std::uint32_t i = trail.count; i > 0 && trail.count - i < size; --i) {
        const auto nearest =
            geometry.scene.closest_point(trail.start[(i - 1) % size], kOverlap * geometry.skin);
        if (!nearest) continue;
        flight.end = FlightEnd::hit;
        flight.triangle = nearest.triangle;
        flight.u = nearest.u;
        flight.v = nearest.v;
        flight.rescued = true;
        return;
    }
    flight.end = geometry.box.rim_inside ? FlightEnd::escaped : FlightEnd::leaked;
}

// Whether the surface is a 2-D profile: all vertices lie on the two periodic sides in y, so that triangles
// span the whole width.
bool is_straight(const TriangleMesh& mesh, const LateralBox& box) {
    return box.boundary[1] == Boundary::periodic && box.boundary[0] != Boundary::open &&
           std::all_of(mesh.vertices.begin(), mesh.vertices.end(),
                       [&](const Vec3& p) { return p.y() == box.min[1] || p.y() == box.max[1]; });
}

}  // namespace

Geometry make_geometry(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box) {
    require_traceable(mesh);
    const Box3 bounds = bounding_box(mesh);
    const double skin = kSkin * bounds.min.cwiseAbs().cwiseMax(bounds.max.cwiseAbs()).maxCoeff();
    // The source plane is above the surface by more than the overlap, yet low, so that grazing particles
    // cross few sides.
    const double margin = 2.0 * kOverlap * skin;
    const double top = bounds.max.z() + margin, bottom = bounds.min.z() - margin;
    if (box.axial)
        return {mesh, scene, box, top, bottom, skin, false, std::make_shared<const Revolution>(mesh)};
    return {mesh, scene, box, top, bottom, skin, is_straight(mesh, box)};
}

RoundFlight fly_round(const Geometry& geometry, const Vec3& position, const Vec3& direction,
                      double free_path) {
    RoundFlight flight;
    flight.point = position;
    flight.direction = direction;
    const double radius = geometry.box.max[0];
    while (flight.flights++ < kMaxSegments) {
        const double rise = flight.direction.z(),
                     exit = rise == 0.0
                                ? kInfinity
                                : ((rise > 0.0 ? geometry.top : geometry.bottom) - flight.point.z()) / rise,
                     side = way_to_cylinder(flight.point, flight.direction, radius),
                     left = free_path - flight.length, way = std::min({side, exit, left});
        const RingHit hit = geometry.revolution->closest_front(flight.point, flight.direction,
                                                               way + kOverlap * geometry.skin);
        if (!hit && exit <= std::min(side, left)) {
            flight.end = rise > 0.0 ? FlightEnd::escaped : FlightEnd::leaked;
            if (rise > 0.0) return flight;
            // A particle that starts in a concave edge may be behind the other face by rounding: a hit there.
            const RingHit slipped = geometry.revolution->nearest(position, kOverlap * geometry.skin);
            if (!slipped) return flight;
            const Turned turned = turned_into_plane(position, direction);
            flight.point = turned.point;
            flight.direction = turned.direction;
            flight.end = FlightEnd::hit;
            flight.segment = slipped.segment;
            flight.along = slipped.along;
            flight.rescued = true;
            return flight;
        }
        const double step = hit ? hit.distance : way;
        const Turned turned = turned_into_plane(flight.point + step * flight.direction, flight.direction);
        flight.point = turned.point;
        flight.direction = turned.direction;
        flight.length += step;
        if (hit || left <= side) {
            flight.end = hit ? FlightEnd::hit : FlightEnd::collided;
            flight.segment = hit.segment;
            flight.along = hit.along;
            return flight;
        }
        flight.point.x() = radius;
        flight.direction.x() = -std::abs(flight.direction.x());
    }
    return flight;
}

DomainExit domain_exit(const Geometry& geometry, const Vec3& start, const Vec3& direction) {
    const double length = direction.z() > 0.0 ? (geometry.top - start.z()) / direction.z() : -1.0;
    DomainExit exit{length >= 0.0, length, start + length * direction};
    const LateralBox& box = geometry.box;
    for (int axis = 0; axis < 2; ++axis)
        if (box.boundary[axis] == Boundary::open)
            exit.to_source =
                exit.to_source && exit.end[axis] >= box.min[axis] && exit.end[axis] <= box.max[axis];
    return exit;
}

namespace {

// Most sides that a path may cross before it rises above the surface. One that crosses more is horizontal up
// to rounding (below 0.006 degrees where the surface is as high as the domain is wide).
constexpr int kMostSides = 10000;

// Takes a path that has hit nothing through the side ahead. False at an open side or above the surface.
bool goes_on(const surface::RayScene& scene, const LateralBox& box, const SideMeeting& side, Vec3& position,
             Vec3& path) {
    return std::isfinite(side.distance) && position.z() + side.distance * path.z() <= scene.top() &&
           cross_side(box, side, position, path);
}

}  // namespace

surface::RayHit first_hit(const surface::RayScene& scene, const LateralBox& box, Vec3 position, Vec3 path) {
    for (int sides = 0; sides < kMostSides; ++sides) {
        const SideMeeting side = next_side(box, position, path);
        if (surface::RayHit hit = scene.closest_hit(position, path, 0.0, side.distance)) return hit;
        if (!goes_on(scene, box, side, position, path)) break;
    }
    return {};
}

bool sees_source(const surface::RayScene& scene, const LateralBox& box, Vec3 position, Vec3 path) {
    for (int sides = 0; sides < kMostSides; ++sides) {
        const SideMeeting side = next_side(box, position, path);
        if (scene.occluded(position, path, 0.0, side.distance)) return false;
        if (!goes_on(scene, box, side, position, path)) return true;
    }
    return false;
}

std::uint32_t sees_source(const Geometry& geometry, const Vec3& position, std::span<const Vec3> paths) {
    std::uint32_t seen = 0;
    if (geometry.revolution) {
        for (std::size_t k = 0; k < paths.size(); ++k)
            if (fly_round(geometry, position, paths[k].normalized()).end == FlightEnd::escaped)
                seen |= 1u << k;
        return seen;
    }
    const surface::RayScene& scene = geometry.scene;
    const LateralBox& box = geometry.box;
    constexpr std::size_t kRays = surface::RayPacket::kRays;
    std::array<Vec3, kRays> at, path;
    std::array<SideMeeting, kRays> side;
    alignas(32) std::array<int, kRays> active{};
    std::fill_n(active.begin(), paths.size(), -1);
    std::fill_n(at.begin(), paths.size(), position);
    std::ranges::copy(paths, path.begin());
    surface::RayPacket packet;
    for (int sides = 0; sides < kMostSides && std::ranges::count(active, -1) > 0; ++sides) {
        for (std::size_t k = 0; k < paths.size(); ++k) {
            if (active[k] == 0) continue;
            side[k] = next_side(box, at[k], path[k]);
            packet.origin_x[k] = static_cast<float>(at[k].x());
            packet.origin_y[k] = static_cast<float>(at[k].y());
            packet.origin_z[k] = static_cast<float>(at[k].z());
            packet.direction_x[k] = static_cast<float>(path[k].x());
            packet.direction_y[k] = static_cast<float>(path[k].y());
            packet.direction_z[k] = static_cast<float>(path[k].z());
            packet.t_min[k] = 0.0f;
            packet.t_max[k] = static_cast<float>(side[k].distance);
        }
        scene.occluded(active.data(), packet);
        for (std::size_t k = 0; k < paths.size(); ++k) {
            if (active[k] == 0) continue;
            const bool hidden = packet.t_max[k] < 0.0f;
            if (!hidden && goes_on(scene, box, side[k], at[k], path[k])) continue;
            if (!hidden) seen |= 1u << k;
            active[k] = 0;
        }
    }
    return seen;
}

Vec3 outward_normal(const Geometry& geometry, std::uint32_t triangle) {
    return area_vector(geometry.mesh, triangle).normalized();
}

Vec3 hit_point(const Geometry& geometry, const Flight& flight) {
    // Embree's triangles have their vertices rounded to float.
    const auto vertex = [&](std::size_t k) -> Vec3 {
        return geometry.mesh.vertices[geometry.mesh.triangles[flight.triangle][k]]
            .cast<float>()
            .cast<double>();
    };
    const double u = flight.u, v = flight.v;
    return (1.0 - u - v) * vertex(0) + u * vertex(1) + v * vertex(2);
}

Flight fly(const Geometry& geometry, Particle particle, double free_path) {
    const bool bounded =
        geometry.box.boundary[0] != Boundary::open && geometry.box.boundary[1] != Boundary::open;
    Flight flight;
    Trail trail;
    double back_up = 0.0, travelled = 0.0;
    while (flight.segments < kMaxSegments) {
        trail.add(particle.position);
        const SideMeeting side = next_side(geometry.box, particle.position, particle.direction);
        const double rise = particle.direction.z();
        const double exit =
            rise == 0.0 ? kInfinity
                        : ((rise > 0.0 ? geometry.top : geometry.bottom) - particle.position.z()) / rise;
        flight.direction = particle.direction;
        const double left = free_path - travelled;
        const SegmentHit hit =
            trace_segment(geometry, particle, back_up, std::min({side.distance, exit, left}), flight);
        if (hit == SegmentHit::front) {
            flight.end = FlightEnd::hit;
            return flight;
        }
        if (hit == SegmentHit::back) {
            flight.rescued = hit_rim(geometry, flight);
            if (flight.rescued)
                flight.end = FlightEnd::hit;
            else
                book_slip(geometry, trail, flight);
            return flight;
        }
        if (left <= std::min(side.distance, exit)) {
            flight.end = FlightEnd::collided;
            return flight;
        }
        if (exit <= side.distance) {
            if (rise > 0.0 || !bounded)
                flight.end = FlightEnd::escaped;  // upwards, or down past an open side's rim
            else
                book_slip(geometry, trail, flight);
            return flight;
        }
        if (!cross_side(geometry.box, side, particle.position, particle.direction)) {
            flight.end = FlightEnd::escaped;
            return flight;
        }
        travelled += side.distance;
        particle.from = surface::kNoTriangle;
        back_up = kOverlap * geometry.skin;
    }
    return flight;
}

}  // namespace sidewall::flux
