// Cost of the flux engine: against bare Embree on the same rays, by threads, and with very many rays.
//
//     flux_bench [--table embree|threads|long] [MESH=GRID_SPACING ...]
//
// Without meshes: the study's surfaces. Without --table: all but the long one, 1e8 rays on each surface.
// Rates are per CPU second of one thread, the best of several runs taken in turns.
#include <dlfcn.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <vector>

#include "surface/embree.hpp"
#include "tests/bench/flux_scene.hpp"

using namespace sidewall;
using bench::cpu_seconds;
using bench::keep_best;
using bench::Scene;

namespace {

struct Segment {
    float origin[3], direction[3], reach;
};

// Records every ray packet that the engine passes to Embree.
struct Recorder {
    bool on = false;
    std::vector<Segment> segments;
    std::vector<std::uint8_t> lanes;
    void clear() {
        segments.clear();
        lanes.clear();
    }
} recorder;

void record(const int* valid, const RTCRay8& r) {
    if (!recorder.on) return;
    std::uint8_t lanes = 0;
    for (int i = 0; i < 8; ++i) {
        if (valid[i] == 0) continue;
        recorder.segments.push_back(
            {{r.org_x[i], r.org_y[i], r.org_z[i]}, {r.dir_x[i], r.dir_y[i], r.dir_z[i]}, r.tfar[i]});
        ++lanes;
    }
    recorder.lanes.push_back(lanes);
}

double wall_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

// Interposes Embree's function, which it calls: the engine is measured and recorded as it is built.
#if RTC_VERSION_MAJOR >= 4
extern "C" void rtcIntersect8(const int* valid, RTCScene scene, RTCRayHit8* packet,
                              RTCIntersectArguments* arguments) {
    static const auto embree = reinterpret_cast<decltype(&rtcIntersect8)>(dlsym(RTLD_NEXT, "rtcIntersect8"));
    record(valid, packet->ray);
    embree(valid, scene, packet, arguments);
}
#else
extern "C" void rtcIntersect8(const int* valid, RTCScene scene, RTCIntersectContext* context,
                              RTCRayHit8* packet) {
    static const auto embree = reinterpret_cast<decltype(&rtcIntersect8)>(dlsym(RTLD_NEXT, "rtcIntersect8"));
    record(valid, packet->ray);
    embree(valid, scene, context, packet);
}
#endif

namespace {

// CPU seconds of Embree alone on the recorded segments, in the engine's packets (width 16: two at a time).
template <std::size_t Width, class Packet, class Intersect>
double replay(RTCScene scene, const Intersect& intersect) {
    alignas(64) std::array<int, Width> valid;
    alignas(64) Packet packet;
    const auto lane = [](auto& values) {  // rtcIntersect1 takes scalars
        if constexpr (Width == 1)
            return &values;
        else
            return &values[0];
    };
    std::uint64_t hits = 0;
    std::size_t next = 0, group = 0;
    const double start = cpu_seconds();
    while (next < recorder.segments.size()) {
        std::size_t count = Width == 1 ? 1 : recorder.lanes[group++];
        if (Width == 16 && count == 8 && group < recorder.lanes.size()) count += recorder.lanes[group++];
        for (std::size_t i = 0; i < Width; ++i) {
            const Segment& s = recorder.segments[std::min(next + i, recorder.segments.size() - 1)];
            valid[i] = i < count ? -1 : 0;
            lane(packet.ray.org_x)[i] = s.origin[0];
            lane(packet.ray.org_y)[i] = s.origin[1];
            lane(packet.ray.org_z)[i] = s.origin[2];
            lane(packet.ray.dir_x)[i] = s.direction[0];
            lane(packet.ray.dir_y)[i] = s.direction[1];
            lane(packet.ray.dir_z)[i] = s.direction[2];
            lane(packet.ray.tnear)[i] = 0.0f;
            lane(packet.ray.tfar)[i] = s.reach;
            lane(packet.ray.time)[i] = 0.0f;
            lane(packet.ray.mask)[i] = 0xffffffffu;
            lane(packet.ray.id)[i] = lane(packet.ray.flags)[i] = 0;
            lane(packet.hit.primID)[i] = lane(packet.hit.geomID)[i] = RTC_INVALID_GEOMETRY_ID;
        }
        intersect(valid.data(), scene, packet);
        for (std::size_t i = 0; i < count; ++i) hits += lane(packet.hit.geomID)[i] != RTC_INVALID_GEOMETRY_ID;
        next += count;
    }
    const double seconds = cpu_seconds() - start;
    if (hits == 0) fmt::print("nothing was hit\n");
    return seconds;
}

constexpr std::uint64_t kRays = 4'000'000;
constexpr int kRepeats = 5;

void against_embree(const Scene& s) {
    for (const double sticking : {1.0, 0.1}) {
        recorder.clear();
        recorder.on = true;
        const std::uint64_t segments = s.trace(sticking, kRays).segments;
        recorder.on = false;
        double engine = 1e9, one = 1e9, eight = 1e9, sixteen = 1e9;
        for (int k = 0; k < kRepeats; ++k) {
            keep_best(engine, [&] { s.trace(sticking, kRays); });
            one = std::min(one, replay<1, RTCRayHit>(s.scene.handle(), [](const int*, auto scene, auto& p) {
                               surface::intersect(scene, p);
                           }));
            const auto packets = [](auto valid, auto scene, auto& p) { surface::intersect(valid, scene, p); };
            eight = std::min(eight, replay<8, RTCRayHit8>(s.scene.handle(), packets));
            sixteen = std::min(sixteen, replay<16, RTCRayHit16>(s.scene.handle(), packets));
        }
        const auto rate = [&](double seconds) { return static_cast<double>(segments) / seconds * 1e-6; };
        fmt::print("{:<10}{:>9}{:>12}{:>10.2f}{:>10.2f}{:>10.2f}{:>10.2f}{:>9.0f} %\n", s.name, sticking,
                   segments, rate(engine), rate(one), rate(eight), rate(sixteen),
                   100.0 * std::min({one, eight, sixteen}) / engine);
    }
    recorder.clear();
    recorder.segments.shrink_to_fit();
}

// Best wall seconds of several runs on 1 and 2 threads, in turns, as other programs may load the machine.
std::array<double, 2> best_by_threads(int runs, const std::function<void()>& trace) {
    std::array<double, 2> seconds{1e9, 1e9};
    for (int k = 0; k < runs; ++k)
        for (const int threads : {1, 2}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                            static_cast<std::size_t>(threads));
            tbb::task_arena arena(threads);
            const double start = wall_seconds();
            arena.execute(trace);
            double& best = seconds[static_cast<std::size_t>(threads - 1)];
            best = std::min(best, wall_seconds() - start);
        }
    return seconds;
}

void by_threads(const Scene& s) {
    for (const double sticking : {1.0, 0.1}) {
        const auto seconds = best_by_threads(8, [&] { s.trace(sticking, kRays); });
        // With hardly any rays the time is that of setting up, closing batches and summing up.
        const auto frame = best_by_threads(8, [&] { s.trace(sticking, 32); });
        fmt::print("{:<10}{:>9}{:>12.3f}{:>12.3f}{:>12.2f}{:>14.4f}{:>12.4f}{:>10.1f} %\n", s.name, sticking,
                   seconds[0], seconds[1], seconds[0] / seconds[1], frame[0], frame[1],
                   100.0 * std::max(0.0, 2.0 * frame[1] - frame[0]) / seconds[0]);
    }
}

void many_rays(const Scene& s) {
    rusage before{}, after{};
    getrusage(RUSAGE_SELF, &before);
    const auto result = s.trace(0.1, 100'000'000);
    getrusage(RUSAGE_SELF, &after);
    fmt::print("{:<10}{:>12}{:>12}{:>9}{:>9}{:>10}{:>14.1f}{:>12.1f}\n", s.name, result.emitted,
               result.segments, result.leaked, result.rescued, result.ledger.balanced() ? "exact" : "BROKEN",
               static_cast<double>(after.ru_maxrss - before.ru_maxrss) / 1024.0, result.seconds);
    if (result.leaked > 0 || !result.ledger.balanced())
        throw NumericsError(s.name + ": particles leaked or the ledger does not balance");
}

}  // namespace

int main(int argc, char** argv) {
    return bench::run_bench("flux_bench", [&] {
        std::string table;
        std::vector<std::string> meshes;
        for (int i = 1; i < argc; ++i) {
            if (std::string(argv[i]) == "--table" && i + 1 < argc)
                table = argv[++i];
            else
                meshes.emplace_back(argv[i]);
        }
        const auto wanted = [&](const std::string& name) {
            return table.empty() ? name != "long" : table == name;
        };
        const std::vector<Scene> scenes = bench::make_scenes(meshes);
        if (wanted("embree")) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
            fmt::print(
                "\nMillion segments a second: the engine, and Embree alone on the same "
                "rays\n{:<10}{:>9}{:>12}{:>10}"
                "{:>10}{:>10}{:>10}{:>11}\n",
                "surface", "sticking", "segments", "engine", "1 wide", "8 wide", "16 wide", "kept");
            for (const Scene& s : scenes) against_embree(s);
        }
        if (wanted("threads")) {
            fmt::print(
                "\nWall seconds by threads, {} rays; and with 32 rays, whose share that is not parallel is "
                "the serial one\n{:<10}{:>9}{:>12}{:>12}{:>12}{:>14}{:>12}{:>12}\n",
                kRays, "surface", "sticking", "1", "2", "ratio", "32 rays, 1", "2", "serial");
            for (const Scene& s : scenes) by_threads(s);
        }
        if (!wanted("long")) return;
        fmt::print("\n1e8 rays, sticking 0.1\n{:<10}{:>12}{:>12}{:>9}{:>9}{:>10}{:>14}{:>12}\n", "surface",
                   "rays", "segments", "leaked", "rescued", "ledger", "memory [MB]", "seconds");
        for (const Scene& s : scenes) many_rays(s);
    });
}
