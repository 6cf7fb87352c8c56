#include "flux/flight.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sidewall::flux {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Skin relative to the largest coordinate: ten times what a position loses when it is rounded to float.
constexpr double kSkin = 0x1p-20;
// A flight of more segments than this is a particle caught in rounding.
constexpr std::uint32_t kMaxSegments = 1'000'000;

RTCRayHit make_query(const Vec3& origin, const Vec3& direction, double t_near, double t_far) {
    RTCRayHit query;
    query.ray.org_x = static_cast<float>(origin.x());
    query.ray.org_y = static_cast<float>(origin.y());
    query.ray.org_z = static_cast<float>(origin.z());
    query.ray.dir_x = static_cast<float>(direction.x());
    query.ray.dir_y = static_cast<float>(direction.y());
    query.ray.dir_z = static_cast<float>(direction.z());
    query.ray.tnear = static_cast<float>(t_near);
    query.ray.tfar = static_cast<float>(t_far);
    query.ray.time = 0.0f;
    query.ray.mask = 0xffffffffu;
    query.ray.id = query.ray.flags = 0;
    query.hit.geomID = query.hit.primID = RTC_INVALID_GEOMETRY_ID;
    return query;
}

// Where the flight's latest segments began: a slip through the surface happened at one of them.
struct Trail {
    std::array<Vec3, 8> start;
    std::uint32_t count = 0;
    void add(const Vec3& position) { start[count++ % start.size()] = position; }
};

// Whether the ray met the triangle from behind. Embree's own normal settles it nearly always; a sliver may
// have turned over when its vertices were rounded to float, so the mesh has the last word.
bool is_behind(const Stage& stage, const Vec3& direction, const RTCHit& hit) {
    const Vec3 normal(static_cast<double>(hit.Ng_x), static_cast<double>(hit.Ng_y),
                      static_cast<double>(hit.Ng_z));
    return direction.dot(normal) > 0.0 && direction.dot(outward_normal(stage, hit.primID)) > kGrazing;
}

enum class Met { nothing, front, back };

// The nearest front or back along one straight segment. Backs within a skin of the start are not met: they
// belong to the far side of a fold that the start was lifted through.
Met meet(const Stage& stage, const Particle& particle, double back_up, double reach, Landing& landing) {
    const Vec3 origin = particle.position - back_up * particle.direction;
    double t_near = 0.0;
    const double t_far = reach + back_up + kOverlap * stage.skin;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    while (true) {
        RTCRayHit query = make_query(origin, particle.direction, t_near, t_far);
        ++landing.segments;
        rtcIntersect1(stage.scene.handle(), &context, &query);
        if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return Met::nothing;
        const std::uint32_t triangle = query.hit.primID;
        const bool back = is_behind(stage, particle.direction, query.hit);
        const double distance = static_cast<double>(query.ray.tfar) - back_up;
        if (triangle != particle.from && !(back && distance < kOverlap * stage.skin)) {
            landing.triangle = triangle;
            landing.u = static_cast<double>(query.hit.u);
            landing.v = static_cast<double>(query.hit.v);
            return back ? Met::back : Met::front;
        }
        // Past the hit by more than its rounding: one step of float may find it again, for ever.
        t_near = std::max(t_near, static_cast<double>(query.ray.tfar)) * (1.0 + 1e-6) + 1e-3 * stage.skin;
        if (!(t_near < t_far)) return Met::nothing;
    }
}

// At a convex rim, rounding may let the far face come first: a ray that meets a back this near to an edge hit
// the rim.
bool met_rim(const Stage& stage, const Landing& landing) {
    const auto [a, b, c] = stage.mesh.triangles[landing.triangle];
    const std::array<Vec3, 3> p{stage.mesh.vertices[a], stage.mesh.vertices[b], stage.mesh.vertices[c]};
    const double twice_area = (p[1] - p[0]).cross(p[2] - p[0]).norm();
    const std::array<double, 3> weight{1.0 - landing.u - landing.v, landing.u, landing.v};
    for (std::size_t k = 0; k < 3; ++k)
        if (weight[k] * twice_area <= kOverlap * stage.skin * (p[(k + 2) % 3] - p[(k + 1) % 3]).norm())
            return true;
    return false;
}

// The particle is behind the surface: it arrives where it slipped through, if that was within the rounding.
void rescue(const Stage& stage, const Trail& trail, Landing& landing) {
    const auto size = static_cast<std::uint32_t>(trail.start.size());
    for (std::uint32_t i = trail.count; i > 0 && trail.count - i < size; --i) {
        const auto nearest = stage.scene.closest_point(trail.start[(i - 1) % size], kOverlap * stage.skin);
        if (!nearest) continue;
        landing.end = End::hit;
        landing.triangle = nearest.triangle;
        landing.u = nearest.u;
        landing.v = nearest.v;
        landing.rescued = true;
        return;
    }
    landing.end = stage.box.rim_inside ? End::escaped : End::leaked;
}

}  // namespace

Stage make_stage(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box) {
    require_traceable(mesh);
    const Box3 bounds = bounding_box(mesh);
    const double skin = kSkin * bounds.min.cwiseAbs().cwiseMax(bounds.max.cwiseAbs()).maxCoeff();
    // The source is clear of the surface by more than the overlap, but low: grazing particles cross few
    // sides.
    const double margin = 2.0 * kOverlap * skin;
    return {mesh, scene, box, bounds.max.z() + margin, bounds.min.z() - margin, skin};
}

Vec3 outward_normal(const Stage& stage, std::uint32_t triangle) {
    return area_vector(stage.mesh, triangle).normalized();
}

Vec3 landing_point(const Stage& stage, const Landing& landing) {
    // The surface that Embree sees has its vertices rounded to float.
    const auto vertex = [&](std::size_t k) -> Vec3 {
        return stage.mesh.vertices[stage.mesh.triangles[landing.triangle][k]].cast<float>().cast<double>();
    };
    const double u = landing.u, v = landing.v;
    return (1.0 - u - v) * vertex(0) + u * vertex(1) + v * vertex(2);
}

Landing fly(const Stage& stage, Particle particle) {
    const bool bounded = stage.box.boundary[0] != Boundary::open && stage.box.boundary[1] != Boundary::open;
    Landing landing;
    Trail trail;
    double back_up = 0.0;
    while (landing.segments < kMaxSegments) {
        trail.add(particle.position);
        const SideMeeting side = next_side(stage.box, particle.position, particle.direction);
        const double rise = particle.direction.z();
        const double exit = rise == 0.0
                                ? kInfinity
                                : ((rise > 0.0 ? stage.top : stage.bottom) - particle.position.z()) / rise;
        landing.direction = particle.direction;
        const Met met = meet(stage, particle, back_up, std::min(side.distance, exit), landing);
        if (met == Met::front) {
            landing.end = End::hit;
            return landing;
        }
        if (met == Met::back) {
            landing.rescued = met_rim(stage, landing);
            if (landing.rescued)
                landing.end = End::hit;
            else
                rescue(stage, trail, landing);
            return landing;
        }
        if (exit <= side.distance) {
            if (rise > 0.0 || !bounded)
                landing.end = End::escaped;  // past the rim of a surface that does not fill its box
            else
                rescue(stage, trail, landing);
            return landing;
        }
        if (!cross_side(stage.box, side, particle.position, particle.direction)) {
            landing.end = End::escaped;
            return landing;
        }
        particle.from = surface::kNoTriangle;
        back_up = kOverlap * stage.skin;
    }
    return landing;
}

}  // namespace sidewall::flux
