#pragma once
#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <tuple>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/random.hpp"
#include "flux/sampling.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"

// The tracer of the first release, kept to measure against: single rays in double precision, analog
// absorption, and bins that all threads share. Its source points were stratified along a Hilbert curve;
// `ordered` false draws them independently, as a plain Monte Carlo tracer does.
namespace sidewall::first_light {

using flux::Boundary;
using flux::cross_side;
using flux::draw;
using flux::Draws;
using flux::LateralBox;
using flux::next_side;
using flux::RandomKey;
using flux::require_traceable;
using flux::SideMeeting;
using flux::Wedges;

/// A mesh as it was handed to Embree then: in whatever instructions the processor has.
class EmbreeScene {
  public:
    explicit EmbreeScene(const TriangleMesh& mesh) {
        rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
        RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* position = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
        for (const Vec3& vertex : mesh.vertices)
            for (int axis = 0; axis < 3; ++axis) *position++ = static_cast<float>(vertex[axis]);
        auto* corner = static_cast<std::uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                    3 * sizeof(std::uint32_t), mesh.triangles.size()));
        for (const Triangle& triangle : mesh.triangles)
            corner = std::copy(triangle.begin(), triangle.end(), corner);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_.get(), geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_.get());
    }
    RTCScene handle() const { return scene_.get(); }

  private:
    std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device_{
        rtcNewDevice("start_threads=0,set_affinity=0"), rtcReleaseDevice};
    std::unique_ptr<RTCSceneTy, decltype(&rtcReleaseScene)> scene_{rtcNewScene(device_.get()),
                                                                   rtcReleaseScene};
};

/// What all particles of a trace share: the surface, the box they fly in, and its rounding. Lengths in world
/// units.
struct Stage {
    const TriangleMesh& mesh;
    const EmbreeScene& embree;
    const surface::RayScene& scene;
    LateralBox box;
    double top = 0.0;     ///< height of the source plane; a particle above it has escaped
    double bottom = 0.0;  ///< below the surface; a particle that gets there slipped through
    double skin = 0.0;    ///< distance that single precision resolves safely anywhere on the surface
};

/// A particle at the start of a flight. Direction of unit length, pointing off \p from.
struct Particle {
    Vec3 position, direction;
    std::uint32_t from =
        surface::kNoTriangle;  ///< the triangle it leaves, which is flat and cannot be hit at once
};

enum class End { hit, escaped, leaked };

/// How a flight ended; where, if it hit.
struct Landing {
    End end = End::leaked;
    std::uint32_t triangle = surface::kNoTriangle;
    double u = 0.0, v = 0.0;     ///< barycentric weights of the second and third vertex
    std::uint32_t segments = 0;  ///< ray-scene intersections it took
    bool rescued = false;        ///< it met the surface from behind by rounding, and arrived where it did
};

inline Vec3 outward_normal(const Stage& stage, std::uint32_t triangle);

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Skin relative to the largest coordinate: ten times what a position loses when it is rounded to float.
constexpr double kSkin = 0x1p-20;
// How far rays reach over side planes, and how far from its start a particle may have slipped; in skins.
constexpr double kOverlap = 8.0;
// A triangle is met from behind only beyond this cosine: at grazing incidence rounding decides the sign.
constexpr double kGrazing = 1e-4;
// A flight of more segments than this is a particle caught in rounding.
constexpr std::uint32_t kMaxSegments = 1'000'000;

inline RTCRayHit make_query(const Vec3& origin, const Vec3& direction, double t_near, double t_far) {
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
inline bool is_behind(const Stage& stage, const Vec3& direction, const RTCHit& hit) {
    const Vec3 normal(static_cast<double>(hit.Ng_x), static_cast<double>(hit.Ng_y),
                      static_cast<double>(hit.Ng_z));
    return direction.dot(normal) > 0.0 && direction.dot(outward_normal(stage, hit.primID)) > kGrazing;
}

enum class Met { nothing, front, back };

// The nearest front or back along one straight segment. Backs within a skin of the start are not met: they
// belong to the far side of a fold that the start was lifted through.
inline Met meet(const Stage& stage, const Particle& particle, double back_up, double reach,
                Landing& landing) {
    const Vec3 origin = particle.position - back_up * particle.direction;
    double t_near = 0.0;
    const double t_far = reach + back_up + kOverlap * stage.skin;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    while (true) {
        RTCRayHit query = make_query(origin, particle.direction, t_near, t_far);
        ++landing.segments;
        rtcIntersect1(stage.embree.handle(), &context, &query);
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
        t_near = static_cast<double>(std::nextafter(query.ray.tfar, std::numeric_limits<float>::infinity()));
        if (!(t_near < t_far)) return Met::nothing;
    }
}

// At a convex rim, rounding may let the far face come first: a ray that meets a back this near to an edge hit
// the rim.
inline bool met_rim(const Stage& stage, const Landing& landing) {
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
inline void rescue(const Stage& stage, const Trail& trail, Landing& landing) {
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
    landing.end = End::leaked;
}

inline Stage make_stage(const TriangleMesh& mesh, const EmbreeScene& embree, const surface::RayScene& scene,
                        const LateralBox& box) {
    require_traceable(mesh);
    const Box3 bounds = bounding_box(mesh);
    const double skin = kSkin * bounds.min.cwiseAbs().cwiseMax(bounds.max.cwiseAbs()).maxCoeff();
    // The source is clear of the surface by more than the overlap, but low: grazing particles cross few
    // sides.
    const double margin = 2.0 * kOverlap * skin;
    return {mesh, embree, scene, box, bounds.max.z() + margin, bounds.min.z() - margin, skin};
}

inline Vec3 outward_normal(const Stage& stage, std::uint32_t triangle) {
    return area_vector(stage.mesh, triangle).normalized();
}

inline Vec3 point_above(const Stage& stage, const Landing& landing, const Vec3& normal) {
    // The surface that Embree sees has its vertices rounded to float.
    const auto vertex = [&](std::size_t k) -> Vec3 {
        return stage.mesh.vertices[stage.mesh.triangles[landing.triangle][k]].cast<float>().cast<double>();
    };
    const double u = landing.u, v = landing.v;
    Vec3 point = (1.0 - u - v) * vertex(0) + u * vertex(1) + v * vertex(2) + stage.skin * normal;
    for (int axis = 0; axis < 2; ++axis)
        point[axis] = std::clamp(point[axis], stage.box.min[axis], stage.box.max[axis]);
    return point;
}

inline Landing fly(const Stage& stage, Particle particle) {
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

// One arrival in fixed point.
constexpr std::uint64_t kOne = std::uint64_t{1} << 24;

inline std::uint64_t fixed(double weight, std::uint64_t limit) {
    return std::min(limit,
                    static_cast<std::uint64_t>(std::max(0.0, weight) * static_cast<double>(kOne) + 0.5));
}

inline void add_relaxed(std::uint64_t& total, std::uint64_t amount) {
    std::atomic_ref(total).fetch_add(amount, std::memory_order_relaxed);
}

// Shared bins, and sums over batches.
struct Tally {
    const Wedges& wedges;
    std::vector<std::uint64_t> triangle, wedge;
    std::vector<double> triangle_sum, triangle_squares, wedge_sum, wedge_squares, vertex_sum, vertex_squares;
    Tally(const TriangleMesh& mesh, const Wedges& w)
        : wedges(w),
          triangle(mesh.triangles.size(), 0),
          wedge(w.count(), 0),
          triangle_sum(triangle.size(), 0.0),
          triangle_squares(triangle_sum),
          wedge_sum(wedge.size(), 0.0),
          wedge_squares(wedge_sum),
          vertex_sum(mesh.vertices.size(), 0.0),
          vertex_squares(vertex_sum) {}
    void add(std::uint32_t t, double u, double v) {
        const std::uint64_t second = fixed(u, kOne), third = fixed(v, kOne - second);
        const std::uint32_t* corner = &wedges.corner[3 * std::size_t{t}];
        add_relaxed(triangle[t], 1);
        add_relaxed(wedge[corner[0]], kOne - second - third);
        add_relaxed(wedge[corner[1]], second);
        add_relaxed(wedge[corner[2]], third);
    }
    void close_batch() {
        tbb::parallel_for(tbb::blocked_range(std::size_t{0}, triangle.size(), 4096), [&](const auto& range) {
            for (std::size_t t = range.begin(); t < range.end(); ++t) {
                const auto x = static_cast<double>(triangle[t]);
                triangle_sum[t] += x;
                triangle_squares[t] += x * x;
                triangle[t] = 0;
            }
        });
        tbb::parallel_for(
            tbb::blocked_range(std::size_t{0}, vertex_sum.size(), 4096), [&](const auto& range) {
                for (std::size_t v = range.begin(); v < range.end(); ++v) {
                    double vertex = 0.0;
                    for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) {
                        const double x = static_cast<double>(wedge[w]) / static_cast<double>(kOne);
                        wedge_sum[w] += x;
                        wedge_squares[w] += x * x;
                        vertex += x;
                        wedge[w] = 0;
                    }
                    vertex_sum[v] += vertex;
                    vertex_squares[v] += vertex * vertex;
                }
            });
    }
};

struct Result {
    std::uint64_t emitted = 0, segments = 0, arrivals = 0;
    std::vector<double> wedge;  // flux
    double relative_error = 0.0;
};

/// Neutrals of one sticking probability from a cos source.
inline Result trace(const TriangleMesh& mesh, const EmbreeScene& embree, const surface::RayScene& scene,
                    const LateralBox& box, double sticking, const Wedges& wedges, std::uint64_t rays,
                    bool ordered, std::uint64_t seed = 1) {
    const Stage stage = make_stage(mesh, embree, scene, box);
    const RandomKey key = flux::random_key(seed, 0, 0);
    constexpr std::uint64_t kBatches = 32;
    const std::uint64_t batch_rays = (rays + kBatches - 1) / kBatches;
    Tally tally(mesh, wedges);
    Result result;
    result.emitted = batch_rays * kBatches;
    std::mutex mutex;
    for (std::uint64_t batch = 0; batch < kBatches; ++batch) {
        tbb::parallel_for(
            tbb::blocked_range<std::uint64_t>(batch * batch_rays, (batch + 1) * batch_rays, 512),
            [&](const auto& range) {
                std::uint64_t segments = 0, arrivals = 0;
                for (std::uint64_t ray = range.begin(); ray < range.end(); ++ray) {
                    const Draws draws = draw(key, ray, 0);
                    double x = draws.uniform(0), y = draws.uniform(1);
                    if (ordered)
                        std::tie(x, y) = flux::sample_square(ray % batch_rays, batch_rays, draws.uniform(0),
                                                             draws.word[1]);
                    Particle particle{
                        Vec3(box.min[0] + x * (box.max[0] - box.min[0]),
                             box.min[1] + y * (box.max[1] - box.min[1]), stage.top),
                        flux::sample_lambertian(-Vec3::UnitZ(), draws.uniform(2), draws.uniform(3))};
                    for (std::uint32_t bounce = 1;; ++bounce) {
                        const Landing landing = fly(stage, particle);
                        segments += landing.segments;
                        if (landing.end != End::hit) break;
                        ++arrivals;
                        tally.add(landing.triangle, landing.u, landing.v);
                        const Draws hit = draw(key, ray, bounce);
                        if (hit.uniform(0) < sticking) break;
                        const Vec3 normal = outward_normal(stage, landing.triangle);
                        particle = {point_above(stage, landing, normal),
                                    flux::sample_lambertian(normal, hit.uniform(1), hit.uniform(2)),
                                    landing.triangle};
                    }
                }
                const std::lock_guard lock(mutex);
                result.segments += segments;
                result.arrivals += arrivals;
            },
            tbb::simple_partitioner{});
        tally.close_batch();
    }
    result.wedge.resize(wedges.count());
    for (std::size_t w = 0; w < wedges.count(); ++w)
        if (wedges.area[w] > 0.0)
            result.wedge[w] =
                tally.wedge_sum[w] * box.area() / static_cast<double>(result.emitted) / wedges.area[w];
    double error = 0.0, flux = 0.0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        const double sum = tally.vertex_sum[v];
        const double spread = std::max(0.0, tally.vertex_squares[v] - sum * sum / kBatches);
        error += std::sqrt(spread * kBatches / (kBatches - 1));
        flux += sum;
    }
    result.relative_error = error / flux;
    return result;
}

}  // namespace sidewall::first_light
