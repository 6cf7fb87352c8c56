#include "surface/ray_scene.hpp"

#include <algorithm>

#include "surface/embree.hpp"
#include "surface/error.hpp"

namespace sidewall::surface {
namespace {

// Embree starts no threads: it runs in the caller's TBB arena. AVX-512 is disabled: its packets are no faster
// and round differently, and without it processors that have it return the same bits as those that do not.
#ifdef __x86_64__
constexpr const char* kDevice = "start_threads=0,set_affinity=0,max_isa=avx2";
#else
constexpr const char* kDevice = "start_threads=0,set_affinity=0";
#endif

constexpr const char* kNoMemory =
    "out of memory for tracing the mesh: use a larger grid_spacing or a smaller extent, free memory or raise its "
    "limit";

RTCRay make_ray(const Vec3& origin, const Vec3& direction, double t_min, double t_max) {
    RTCRay ray{};
    ray.org_x = static_cast<float>(origin.x());
    ray.org_y = static_cast<float>(origin.y());
    ray.org_z = static_cast<float>(origin.z());
    ray.dir_x = static_cast<float>(direction.x());
    ray.dir_y = static_cast<float>(direction.y());
    ray.dir_z = static_cast<float>(direction.z());
    ray.tnear = static_cast<float>(t_min);
    ray.tfar = static_cast<float>(t_max);
    ray.mask = 0xffffffffu;
    return ray;
}

}  // namespace

void RayScene::Release::operator()(RTCDeviceTy* device) const {
    rtcReleaseDevice(device);
}

void RayScene::Release::operator()(RTCSceneTy* scene) const {
    rtcReleaseScene(scene);
}

RayScene::RayScene(const TriangleMesh& mesh) : vertices_(mesh.vertices), triangles_(mesh.triangles) {
    if (mesh.triangles.empty()) throw GeometryError("cannot trace an empty mesh: it has no triangle");
    top_ = bounding_box(mesh).max.z();
    device_.reset(rtcNewDevice(kDevice));
    if (!device_) throw NumericsError(kNoMemory);
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_MEDIUM);

    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    auto* indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (!positions || !indices) throw NumericsError(kNoMemory);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        for (int k = 0; k < 3; ++k)
            positions[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(mesh.vertices[i][k]);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        std::copy(mesh.triangles[t].begin(), mesh.triangles[t].end(), indices + 3 * t);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) throw NumericsError(kNoMemory);
}

RayHit RayScene::closest_hit(const Vec3& origin, const Vec3& direction, double t_min, double t_max) const {
    RTCRayHit query{};
    query.ray = make_ray(origin, direction, t_min, t_max);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    intersect(scene_.get(), query);
    RayHit hit;
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
    hit.triangle = query.hit.primID;
    hit.distance = static_cast<double>(query.ray.tfar);
    hit.u = static_cast<double>(query.hit.u);
    hit.v = static_cast<double>(query.hit.v);
    hit.point = origin + hit.distance * direction;
    hit.normal = Eigen::Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).cast<double>();
    return hit;
}

static_assert(sizeof(RayPacket) >= sizeof(RTCRayHit8) && alignof(RayPacket) == alignof(RTCRayHit8) &&
              offsetof(RayPacket, t_max) == offsetof(RTCRay8, tfar) &&
              offsetof(RayPacket, normal_x) == offsetof(RTCRayHit8, hit) &&
              offsetof(RayPacket, triangle) == offsetof(RTCRayHit8, hit) + offsetof(RTCHit8, primID) &&
              RTC_INVALID_GEOMETRY_ID == kNoTriangle);

namespace {

void begin_query(RayPacket& packet) {
    for (std::size_t i = 0; i < RayPacket::kRays; ++i) {
        packet.time[i] = 0.0f;
        packet.mask[i] = 0xffffffffu;
        packet.id[i] = packet.flags[i] = 0;
        packet.geometry[i] = packet.triangle[i] = kNoTriangle;
    }
}

}  // namespace

void RayScene::occluded(const int* active, RayPacket& packet) const {
    begin_query(packet);
    find_any(active, scene_.get(), reinterpret_cast<RTCRay8&>(packet));  // begins with an RTCRay8
}

void RayScene::closest_hits(const int* active, RayPacket& packet) const {
    begin_query(packet);
    intersect(active, scene_.get(), reinterpret_cast<RTCRayHit8&>(packet));
}

bool RayScene::occluded(const Vec3& origin, const Vec3& direction, double t_min, double t_max) const {
    RTCRay ray = make_ray(origin, direction, t_min, t_max);
    find_any(scene_.get(), ray);
    return ray.tfar < 0.0f;
}

SurfaceHit closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto result = [&](double u, double v) {
        SurfaceHit hit;
        hit.triangle = 0;
        hit.u = u;
        hit.v = v;
        hit.point = a + u * (b - a) + v * (c - a);
        hit.distance = (p - hit.point).norm();
        return hit;
    };
    // On an edge of zero length the ratio would be 0/0: take the edge's start point.
    const auto ratio = [](double n, double d) { return d > 0.0 ? n / d : 0.0; };
    const Vec3 ab = b - a, ac = c - a, ap = p - a;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0.0 && d2 <= 0.0) return result(0.0, 0.0);
    const Vec3 bp = p - b;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0.0 && d4 <= d3) return result(1.0, 0.0);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return result(ratio(d1, d1 - d3), 0.0);
    const Vec3 cp = p - c;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0.0 && d5 <= d6) return result(0.0, 1.0);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return result(0.0, ratio(d2, d2 - d6));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
        const double w = ratio(d4 - d3, (d4 - d3) + (d5 - d6));
        return result(1.0 - w, w);
    }
    const double sum = va + vb + vc;
    return result(vb / sum, vc / sum);
}

namespace {

struct ClosestPointQuery {
    const RayScene& scene;
    Vec3 query;
    double padding;  // added to search radii, so that single-precision rounding hides no nearer triangle
    SurfaceHit best;
};

bool visit_triangle(RTCPointQueryFunctionArguments* args) {
    auto* state = static_cast<ClosestPointQuery*>(args->userPtr);
    const auto [a, b, c] = state->scene.triangles()[args->primID];
    const auto v = state->scene.vertices();
    SurfaceHit hit = closest_point_on_triangle(state->query, v[a], v[b], v[c]);
    hit.triangle = args->primID;
    // Ties go to the lower index, so that the answer does not depend on the traversal order.
    const bool nearer = hit.distance < state->best.distance ||
                        (hit.distance == state->best.distance && hit.triangle < state->best.triangle);
    if (!nearer) return false;
    state->best = hit;
    const auto shrunk = static_cast<float>(hit.distance * (1.0 + 1e-6) + state->padding);
    if (shrunk >= args->query->radius) return false;
    args->query->radius = shrunk;
    return true;
}

}  // namespace

SurfaceHit RayScene::closest_point(const Vec3& query, double radius) const {
    const double padding = 1e-6 * query.cwiseAbs().maxCoeff();
    ClosestPointQuery state{*this, query, padding, {}};
    state.best.distance = radius;
    RTCPointQuery point{};
    point.x = static_cast<float>(query.x());
    point.y = static_cast<float>(query.y());
    point.z = static_cast<float>(query.z());
    point.radius = static_cast<float>(radius * (1.0 + 1e-6) + padding);
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_.get(), &point, &context, visit_triangle, &state);
    if (!state.best) state.best = SurfaceHit{};
    return state.best;
}

SurfaceHit RayScene::closest_point(const Vec3& query, double radius,
                                   const std::array<double, 2>& period) const {
    // A repeat must be nearer by more than rounding.
    const double least = 1e-9 * (query.cwiseAbs().maxCoeff() + period[0] + period[1]);
    SurfaceHit best = closest_point(query, radius);
    for (const int x : {0, 1, -1})
        for (const int y : {0, 1, -1}) {
            if ((x == 0 && y == 0) || (x != 0 && period[0] == 0.0) || (y != 0 && period[1] == 0.0)) continue;
            if (best && best.distance <= least) return best;
            const SurfaceHit hit = closest_point(query + Vec3(x * period[0], y * period[1], 0.0),
                                                 best ? best.distance - least : radius);
            if (hit) best = hit;
        }
    return best;
}

}  // namespace sidewall::surface
