// How fast the tracer runs on a deep trench, and how much of its time is Embree's: the same number of
// segments, and the segments' own origins and directions, through a bare loop of rtcIntersect1.
//
//     flux_bench [THREADS]    (default 1)
//
// Rates are per CPU second.
#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <vector>

#include "flux/flight.hpp"
#include "flux/random.hpp"
#include "flux/sampling.hpp"
#include "flux/tracer.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

// CPU seconds of the whole process: a ratio of them survives a busy machine.
double now() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// A trench 2 wide and 10 deep in 5 x 5, extruded along y, as fine as a grid of spacing 0.045 would extract
// it.
TriangleMesh deep_trench() {
    constexpr double kCell = 0.045, kLength = 5.0;
    const std::vector<std::pair<double, double>> corners{{-2.5, 0}, {-1, 0}, {-1, -10},
                                                         {1, -10},  {1, 0},  {2.5, 0}};
    std::vector<std::pair<double, double>> profile{corners.front()};
    for (std::size_t i = 1; i < corners.size(); ++i) {
        const auto [x0, z0] = corners[i - 1];
        const auto [x1, z1] = corners[i];
        const int n = static_cast<int>(std::ceil(std::hypot(x1 - x0, z1 - z0) / kCell));
        for (int k = 1; k <= n; ++k) profile.emplace_back(x0 + (x1 - x0) * k / n, z0 + (z1 - z0) * k / n);
    }
    const auto rows = static_cast<std::uint32_t>(kLength / kCell);
    TriangleMesh mesh;
    for (const auto& [x, z] : profile)
        for (std::uint32_t j = 0; j <= rows; ++j) mesh.vertices.emplace_back(x, kLength * j / rows, z);
    for (std::uint32_t i = 0; i + 1 < profile.size(); ++i)
        for (std::uint32_t j = 0; j < rows; ++j) {
            const std::uint32_t a = i * (rows + 1) + j, b = a + rows + 1;
            mesh.triangles.push_back({a, b, b + 1});
            mesh.triangles.push_back({a, b + 1, a + 1});
        }
    return mesh;
}

struct Segment {
    float origin[3], direction[3], reach;
};

// The segments of the first histories, as the tracer would fly them (sides and source alike), for replay.
std::vector<Segment> record_segments(const TriangleMesh& mesh, const surface::RayScene& scene,
                                     const LateralBox& box, double sticking, std::uint64_t batch_rays,
                                     std::size_t count) {
    const Stage stage = make_stage(mesh, scene, box);
    const RandomKey key = random_key(1, 0, 0);
    std::vector<Segment> segments;
    for (std::uint64_t ray = 0; segments.size() < count; ++ray) {
        const Draws draws = draw(key, ray, 0);
        const auto [x, y] = sample_square(ray % batch_rays, batch_rays, draws.uniform(0), draws.word[1]);
        Particle particle{Vec3(box.min[0] + x * (box.max[0] - box.min[0]),
                               box.min[1] + y * (box.max[1] - box.min[1]), stage.top),
                          sample_cosine_power(-Vec3::UnitZ(), 1.0, draws.uniform(2), draws.uniform(3))};
        for (std::uint32_t bounce = 1;; ++bounce) {
            const Landing landing = fly(stage, particle);
            Vec3 position = particle.position, direction = particle.direction;
            for (std::uint32_t s = 0; s < landing.segments; ++s) {
                const SideMeeting side = next_side(box, position, direction);
                segments.push_back({{static_cast<float>(position.x()), static_cast<float>(position.y()),
                                     static_cast<float>(position.z())},
                                    {static_cast<float>(direction.x()), static_cast<float>(direction.y()),
                                     static_cast<float>(direction.z())},
                                    static_cast<float>(side.distance)});
                cross_side(box, side, position, direction);
            }
            const Draws scattered = draw(key, ray, bounce);
            if (landing.end != End::hit || scattered.uniform(0) < sticking) break;
            const Vec3 normal = outward_normal(stage, landing.triangle);
            particle = {point_above(stage, landing, normal),
                        sample_lambertian(normal, scattered.uniform(1), scattered.uniform(2)),
                        landing.triangle};
        }
    }
    segments.resize(count);
    return segments;
}

// Segments a second of rtcIntersect1 alone.
double bare_rate(const surface::RayScene& scene, const std::vector<Segment>& segments) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    std::uint64_t hits = 0;
    const double start = now();
    for (const Segment& s : segments) {
        RTCRayHit query{};
        query.ray.org_x = s.origin[0];
        query.ray.org_y = s.origin[1];
        query.ray.org_z = s.origin[2];
        query.ray.dir_x = s.direction[0];
        query.ray.dir_y = s.direction[1];
        query.ray.dir_z = s.direction[2];
        query.ray.tfar = s.reach;
        query.ray.mask = 0xffffffffu;
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene.handle(), &context, &query);
        hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    const double seconds = now() - start;
    if (hits == 0) fmt::print("nothing was hit\n");
    return static_cast<double>(segments.size()) / seconds;
}

}  // namespace

int main(int argc, char** argv) {
    const std::size_t threads = argc > 1 ? static_cast<std::size_t>(std::atoi(argv[1])) : 1;
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const TriangleMesh mesh = deep_trench();
    const surface::RayScene scene(mesh);
    const LateralBox box = lateral_box(mesh, {Boundary::reflective, Boundary::periodic});
    const double start = now();
    const Wedges wedges = make_wedges(mesh);
    fmt::print("{} triangles, {} threads; wedges {:.3f} s\n", mesh.triangles.size(), threads, now() - start);
    fmt::print("{:>8} {:>9} {:>11} {:>8} {:>10} {:>13} {:>13} {:>13} {:>6} {:>7}\n", "sticking", "rays",
               "segments", "seconds", "Mrays/s", "Mseg/s", "bare Mseg/s", "bare/tracer", "leaked", "rescued");
    for (const double sticking : {1.0, 0.1}) {
        const std::uint64_t rays = sticking == 1.0 ? 4'000'000 : 1'000'000;
        const TraceOptions options{.rays = rays};
        const double begin = now();
        const FluxResult result =
            trace_flux(mesh, scene, box, {"bench", 1.0, {sticking}}, {}, wedges, options);
        const double seconds = now() - begin;
        const auto segments = record_segments(mesh, scene, box, sticking, rays / options.batches, 2'000'000);
        const double bare = bare_rate(scene, segments);
        const double rate = static_cast<double>(result.segments) / seconds;
        fmt::print("{:>8} {:>9} {:>11} {:>8.2f} {:>10.2f} {:>13.2f} {:>13.2f} {:>13.2f} {:>6} {:>7}\n",
                   sticking, result.emitted, result.segments, seconds,
                   static_cast<double>(result.emitted) / seconds * 1e-6, rate * 1e-6, bare * 1e-6,
                   bare / rate, result.leaked, result.rescued);
    }
}
