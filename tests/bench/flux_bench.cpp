// What the flux engine costs: against bare Embree on the same rays, against the first release's tracer, to a
// given accuracy, by threads, and with several species a pass.
//
//     flux_bench [--table embree|first|accuracy|threads|species|long] [MESH ...]
//
// Without meshes: two surfaces made here, low relief and deep features. All tables but
// the long one, 1e8 rays on each surface, unless one is named. Rates are per CPU second of one thread, the
// best of several runs taken in turns.
#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "app/flux_gradient.hpp"
#include "flux/smoothing.hpp"
#include "flux/tracer.hpp"
#include "simplify/simplify.hpp"
#include "surface/mesh_io.hpp"
#include "tests/bench/first_light.hpp"
#include "tests/bench/study_surfaces.hpp"

using namespace sidewall;

namespace {

struct Segment {
    float origin[3], direction[3], reach;
};

// Every packet the engine asks Embree for, while recording.
struct Recorder {
    bool on = false;
    std::vector<Segment> segments;
    std::vector<std::uint8_t> lanes;
    void clear() {
        segments.clear();
        lanes.clear();
    }
} recorder;

double cpu_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double wall_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

// Stands before Embree's own, which it calls: so the engine is measured and recorded as it is built.
extern "C" void rtcIntersect8(const int* valid, RTCScene scene, RTCIntersectContext* context,
                              RTCRayHit8* packet) {
    using Function = void (*)(const int*, RTCScene, RTCIntersectContext*, RTCRayHit8*);
    static const auto embree = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "rtcIntersect8"));
    if (recorder.on) {
        std::uint8_t lanes = 0;
        const RTCRay8& r = packet->ray;
        for (int i = 0; i < 8; ++i) {
            if (valid[i] == 0) continue;
            recorder.segments.push_back(
                {{r.org_x[i], r.org_y[i], r.org_z[i]}, {r.dir_x[i], r.dir_y[i], r.dir_z[i]}, r.tfar[i]});
            ++lanes;
        }
        recorder.lanes.push_back(lanes);
    }
    embree(valid, scene, context, packet);
}

namespace {

// CPU seconds of Embree alone on the recorded segments, in packets as the engine formed them (16: two of
// them).
template <std::size_t Width, class Packet, class Intersect>
double replay(RTCScene scene, const Intersect& intersect) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    alignas(64) std::array<int, Width> valid;
    alignas(64) Packet packet;
    const auto lane = [](auto& values) {  // rtcIntersect1 has plain numbers
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
        intersect(valid.data(), scene, &context, &packet);
        for (std::size_t i = 0; i < count; ++i) hits += lane(packet.hit.geomID)[i] != RTC_INVALID_GEOMETRY_ID;
        next += count;
    }
    const double seconds = cpu_seconds() - start;
    if (hits == 0) fmt::print("nothing was hit\n");
    return seconds;
}

struct Scene {
    std::string name;
    TriangleMesh mesh;
    surface::RayScene scene;
    flux::LateralBox box;
    flux::Wedges wedges;
    Scene(std::string label, TriangleMesh surface)
        : name(std::move(label)),
          mesh(std::move(surface)),
          scene(mesh),
          box(flux::lateral_box(mesh, {flux::Boundary::periodic, flux::Boundary::periodic})),
          wedges(flux::make_wedges(mesh)) {}
    flux::FluxResult trace(double sticking, std::uint64_t rays, std::uint64_t seed = 1) const {
        return flux::trace_flux(mesh, scene, box, {"bench", 1.0, {sticking}}, {}, wedges,
                                {.rays = rays, .seed = seed});
    }
};

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
            const double start = cpu_seconds();
            s.trace(sticking, kRays);
            engine = std::min(engine, cpu_seconds() - start);
            one = std::min(
                one, replay<1, RTCRayHit>(s.scene.handle(), [](int*, auto scene, auto* context, auto* p) {
                    rtcIntersect1(scene, context, p);
                }));
            eight = std::min(eight, replay<8, RTCRayHit8>(s.scene.handle(), rtcIntersect8));
            sixteen = std::min(sixteen, replay<16, RTCRayHit16>(s.scene.handle(), rtcIntersect16));
        }
        const auto rate = [&](double seconds) { return static_cast<double>(segments) / seconds * 1e-6; };
        fmt::print("{:<10}{:>9}{:>12}{:>10.2f}{:>10.2f}{:>10.2f}{:>10.2f}{:>9.0f} %\n", s.name, sticking,
                   segments, rate(engine), rate(one), rate(eight), rate(sixteen),
                   100.0 * std::min({one, eight, sixteen}) / engine);
    }
    recorder.clear();
    recorder.segments.shrink_to_fit();
}

void against_first_light(const Scene& s) {
    for (const double sticking : {1.0, 0.1}) {
        double random = 1e9, ordered = 1e9, engine = 1e9;
        const auto best = [](double& seconds, auto&& trace) {
            const double start = cpu_seconds();
            trace();
            seconds = std::min(seconds, cpu_seconds() - start);
        };
        for (int k = 0; k < 3; ++k) {
            for (const bool order : {false, true})
                best(order ? ordered : random,
                     [&] { first_light::trace(s.mesh, s.scene, s.box, sticking, s.wedges, kRays, order); });
            best(engine, [&] { s.trace(sticking, kRays); });
        }
        const auto rate = [&](double seconds) { return static_cast<double>(kRays) / seconds * 1e-6; };
        fmt::print("{:<10}{:>9}{:>12.2f}{:>12.2f}{:>12.2f}{:>12.2f}{:>12.2f}\n", s.name, sticking,
                   rate(random), rate(ordered), rate(engine), random / engine, ordered / engine);
    }
}

// A tenth of the vertices, or what the options say.
TriangleMesh simplified(const TriangleMesh& mesh, simplify::Options options) {
    TriangleMesh raw = mesh;  // periodic sides must keep matching each other
    Attribute fixed{"fixed", 1, Scalar::int32, std::vector<double>(raw.vertices.size(), 0.0)};
    const Box3 bounds = bounding_box(raw);
    for (std::size_t v = 0; v < raw.vertices.size(); ++v)
        for (int axis = 0; axis < 2; ++axis)
            if (raw.vertices[v][axis] == bounds.min[axis] || raw.vertices[v][axis] == bounds.max[axis])
                fixed.values[v] = 1.0;
    raw.vertex_attributes.push_back(std::move(fixed));
    // Creases count as features.
    std::vector<std::uint8_t> features;
    if (options.method != simplify::Method::lindstrom_turk) {
        const flux::Wedges wedges = flux::make_wedges(raw);
        for (std::size_t v = 0; v < raw.vertices.size(); ++v)
            features.push_back(wedges.first[v + 1] - wedges.first[v] > 1);
    }
    return simplify::simplify(raw, features, options).mesh;
}

simplify::Options tenth(const TriangleMesh& mesh) {
    simplify::Options options;
    options.method = simplify::Method::lindstrom_turk;
    options.target_vertices = mesh.vertices.size() / 10;
    options.weights = simplify::kShapeWeights;
    return options;
}

// Where two meshes are compared: the middles of the raw triangles, and the same places on the other mesh.
std::vector<double> flux_at(const Scene& raw, const Scene& s, const flux::FluxResult& result) {
    std::vector<double> values;
    for (std::size_t t = 0; t < raw.mesh.triangles.size(); ++t) {
        const auto hit = s.scene.closest_point(triangle_centroid(raw.mesh, t), 1e9);
        values.push_back(flux::interpolate(s.wedges, result.wedge.flux, hit.triangle, hit.u, hit.v));
    }
    return values;
}

// What a simplified mesh does to the flux, whatever the rays: root mean square of f - truth over the area.
// Two independent traces of each mesh, so that noise drops out of the product of their differences. What the
// noise leaves of it is the spread of the product.
struct Bias {
    double value = 0.0, limit = 0.0;  // limit: two standard errors of the value's square, as a root
};

Bias bias_of(const Scene& raw, const std::array<std::vector<double>, 2>& truth,
             const std::array<std::vector<double>, 2>& flux) {
    double sum = 0.0, squares = 0.0, scale = 0.0, area = 0.0;
    for (std::size_t t = 0; t < raw.mesh.triangles.size(); ++t) {
        const double a = triangle_area(raw.mesh, t);
        const double product = (flux[0][t] - truth[0][t]) * (flux[1][t] - truth[1][t]);
        sum += a * product;
        squares += a * a * product * product;
        scale += a * truth[0][t];
        area += a;
    }
    const double mean = scale / area;
    return {std::sqrt(std::max(0.0, sum / area)) / mean, std::sqrt(2.0 * std::sqrt(squares) / area) / mean};
}

// The edges that a time step before leaves to this one: its flux, traced on the default mesh, bounds them.
std::vector<double> lengths_by_flux(const Scene& raw, double sticking, double dx) {
    const Scene before("", simplified(raw.mesh, {}));
    app::SurfaceFlux surface;
    surface.raw = before.mesh;
    surface.wedges = before.wedges;
    surface.fluxes = {before.trace(sticking, kRays / 4, 30)};
    const flux::FluxResult& result = surface.fluxes.front();
    surface.wedge_flux = {flux::smoothed_flux(before.mesh, before.wedges, result.wedge, result.arrivals)};
    surface.wedge_error = {result.wedge.error};
    const app::CoverageField field =
        app::coverage_field(before.mesh, before.wedges, {app::kFluxGradient}, {app::flux_gradient(surface)});
    constexpr double kChange = 0.1;  // the recipes' default
    return app::resolving_lengths(field, raw.mesh, kChange, dx);
}

void to_two_percent(const Scene& raw) {
    const double dx = simplify::base_length(raw.mesh, {}, {});
    struct Variant {
        const char* name;
        simplify::Options options;
    };
    std::vector<Variant> variants{{"LT shape 90 %", tenth(raw.mesh)},
                                  {"LT 90 %", tenth(raw.mesh)},
                                  {"LT 75 %", tenth(raw.mesh)},
                                  {"LT 0.02 dx", {}},
                                  {"bounded 0.05 dx", {}},
                                  {"bounded 0.02 dx", {}},
                                  {"bounded, by flux", {}}};
    variants[1].options.weights = variants[2].options.weights = simplify::kVolumeWeights;
    variants[2].options.target_vertices = raw.mesh.vertices.size() / 4;
    variants[3].options.method = simplify::Method::lindstrom_turk;
    variants[3].options.l_max = 3.0 * dx;
    variants[3].options.max_error = 0.02 * dx;
    variants[5].options.max_error = 0.02 * dx;
    constexpr double kTarget = 0.02;
    for (const double sticking : {1.0, 0.1}) {
        double begin = cpu_seconds();
        const auto old =
            first_light::trace(raw.mesh, raw.scene, raw.box, sticking, raw.wedges, kRays / 4, false);
        // The error falls with the square root of the rays.
        const double first = (cpu_seconds() - begin) * std::pow(old.relative_error / kTarget, 2.0);
        const std::vector<double> lengths = lengths_by_flux(raw, sticking, dx);
        variants.back().options.max_length_at = lengths;
        std::array<std::vector<double>, 2> truth, flux;
        for (std::uint64_t k = 0; k < 2; ++k)
            truth[k] = flux_at(raw, raw, raw.trace(sticking, 4 * kRays, 10 + k));
        for (const auto& [name, options] : variants) {
            begin = cpu_seconds();
            const Scene coarse(name, simplified(raw.mesh, options));
            const double simplification = cpu_seconds() - begin;
            begin = cpu_seconds();
            const auto fast =
                flux::trace_flux_to(kTarget, coarse.mesh, coarse.scene, coarse.box,
                                    {"bench", 1.0, {sticking}}, {}, coarse.wedges, {.rays = 1'000'000'000});
            const double seconds = cpu_seconds() - begin;
            for (std::uint64_t k = 0; k < 2; ++k)
                flux[k] = flux_at(raw, coarse, coarse.trace(sticking, 2 * kRays, 20 + k));
            const Bias b = bias_of(raw, truth, flux);
            // What the bias leaves for the noise, which costs rays; in squares.
            const double room = 1.0 - std::pow(b.value / kTarget, 2.0);
            fmt::print(
                "{:<10}{:>9}  {:<16}{:>9.1f} "
                "%{:>10.2f}{:>10.2f}{:>10.4f}{:>9.1f}{:>9.1f}{:>10.4f}{:>10.4f}{:>9}\n",
                raw.name, sticking, name,
                100.0 - 100.0 * static_cast<double>(coarse.mesh.vertices.size()) /
                            static_cast<double>(raw.mesh.vertices.size()),
                simplification, seconds, fast.relative_error, first, first / seconds, b.value, b.limit,
                room > 0.0 ? fmt::format("{:.1f}", first / (simplification + seconds / room)) : "none");
        }
    }
}

// Best wall seconds of several runs on 1 and 2 threads, taken in turns: others may be busy on this machine.
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
        // Hardly any ray: what is left is setting up, closing batches and summing up.
        const auto frame = best_by_threads(8, [&] { s.trace(sticking, 32); });
        fmt::print("{:<10}{:>9}{:>12.3f}{:>12.3f}{:>12.2f}{:>14.4f}{:>12.4f}{:>10.1f} %\n", s.name, sticking,
                   seconds[0], seconds[1], seconds[0] / seconds[1], frame[0], frame[1],
                   100.0 * std::max(0.0, 2.0 * frame[1] - frame[0]) / seconds[0]);
    }
}

// Species of one pass: their stickings, or where coverages decide them, those by wedge.
struct Together {
    std::string name;
    std::vector<flux::Species> species;
    std::vector<double> by_wedge;
};

Together with_stickings(double a, double b) {
    return {fmt::format("{}, {}", a, b), {{"first", 1.0, {a}}, {"second", 1.0, {b}}}, {}};
}

// SF6/O2 at the default fluxes and stickings, beta (1 - theta), with the coverages nearly settled; ions, as a
// vertical beam, act on what faces up, shadowed or not.
Together sulphur_hexafluoride(const Scene& s) {
    constexpr double kEtchant = 4500.0, kOxygen = 800.0, kSigma = 300.0, kBetaSigma = 0.04;
    constexpr double kBetaE = 0.7, kBetaP = 1.0;
    constexpr double kEnhanced = 860.0, kRemoval = 205.0;  // by ions of 100 eV on a plane
    Together pair{"sf6_o2", {{"etchant", 1.0, {kBetaE}}, {"oxygen", 1.0, {kBetaP}}}, {}};
    const std::size_t n = s.wedges.count();
    std::vector<double> up(n, 0.0);  // cosine of the ions' incidence
    for (std::size_t c = 0; c < s.wedges.corner.size(); ++c) {
        const auto [i, j, k] = s.mesh.triangles[c / 3];
        const auto& x = s.mesh.vertices;
        up[s.wedges.corner[c]] = std::max(0.0, (x[j] - x[i]).cross(x[k] - x[i]).normalized().z());
    }
    pair.by_wedge = std::vector<double>(n, kBetaE);
    pair.by_wedge.resize(2 * n, kBetaP);
    for (int k = 0; k < 6; ++k) {
        const auto results =
            flux::trace_fluxes(s.mesh, s.scene, s.box, pair.species, {}, s.wedges,
                               {.rays = kRays / 4, .step = 90, .sticking_by_wedge = pair.by_wedge});
        for (std::size_t w = 0; w < n; ++w) {
            // Steady Langmuir coverages of two species that compete for sites.
            const double e = kBetaE * kEtchant * results[0].wedge.flux[w] / (kSigma + kEnhanced * up[w]);
            const double p = kBetaP * kOxygen * results[1].wedge.flux[w] / (kBetaSigma + kRemoval * up[w]);
            const double free = 1.0 / (1.0 + e + p);
            pair.by_wedge[w] = kBetaE * free;
            pair.by_wedge[n + w] = kBetaP * free;
        }
    }
    return pair;
}

// One pass for both species against a pass each: the time of equal rays, and what that leaves of noise; the
// time to a noise of 5 % of each.
void several_species(const Scene& s) {
    constexpr double kTarget = 0.05;
    for (const Together& pair : {with_stickings(1.0, 0.3), with_stickings(0.3, 0.1),
                                 with_stickings(1.0, 0.02), sulphur_hexafluoride(s)}) {
        const std::size_t n = s.wedges.count();
        const auto options = [&](std::uint64_t rays) {
            return flux::TraceOptions{.rays = rays, .sticking_by_wedge = pair.by_wedge};
        };
        const auto alone = [&](std::size_t k, flux::TraceOptions own) {
            own.species_index = static_cast<std::uint32_t>(k);
            if (!pair.by_wedge.empty()) own.sticking_by_wedge = own.sticking_by_wedge.subspan(k * n, n);
            return own;
        };
        std::array<flux::FluxResult, 2> apart, apart_to;
        std::vector<flux::FluxResult> shared, shared_to;
        std::array<double, 2> own{1e9, 1e9}, own_to{1e9, 1e9};
        double one = 1e9, one_to = 1e9;
        const auto best = [](double& seconds, auto&& trace) {
            const double start = cpu_seconds();
            trace();
            seconds = std::min(seconds, cpu_seconds() - start);
        };
        constexpr std::uint64_t kMost = 1'000'000'000;
        for (int repeat = 0; repeat < 3; ++repeat) {
            best(one, [&] {
                shared = flux::trace_fluxes(s.mesh, s.scene, s.box, pair.species, {}, s.wedges,
                                            options(kRays / 2));
            });
            for (std::size_t k = 0; k < 2; ++k)
                best(own[k], [&] {
                    apart[k] = flux::trace_flux(s.mesh, s.scene, s.box, pair.species[k], {}, s.wedges,
                                                alone(k, options(kRays / 2)));
                });
        }
        best(one_to, [&] {
            shared_to = flux::trace_fluxes_to(kTarget, s.mesh, s.scene, s.box, pair.species, {}, s.wedges,
                                              options(kMost));
        });
        for (std::size_t k = 0; k < 2; ++k)
            best(own_to[k], [&] {
                apart_to[k] = flux::trace_flux_to(kTarget, s.mesh, s.scene, s.box, pair.species[k], {},
                                                  s.wedges, alone(k, options(kMost)));
            });
        const auto rate = [](double seconds) { return static_cast<double>(kRays / 2) / seconds * 1e-6; };
        fmt::print("{:<6}{:<10}{:>8.2f}{:>8.2f}{:>8.2f}{:>8.2f}", s.name, pair.name, rate(own[0]),
                   rate(own[1]), rate(one), (own[0] + own[1]) / one);
        for (std::size_t k = 0; k < 2; ++k)
            fmt::print("{:>9.4f}{:>9.4f}", apart[k].relative_error, shared[k].relative_error);
        // Every species to the error that its own pass leaves: the rays that the slower one needs.
        const auto needs = [&](std::size_t k) {
            return std::pow(shared[k].relative_error / apart[k].relative_error, 2.0);
        };
        fmt::print("{:>8.2f}", (own[0] + own[1]) / (one * std::max(needs(0), needs(1))));
        fmt::print("{:>8.2f}{:>8.2f}{:>8.2f}{:>8.2f}\n", own_to[0], own_to[1], one_to,
                   (own_to[0] + own_to[1]) / one_to);
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
}

}  // namespace

int main(int argc, char** argv) {
    openvdb::initialize();
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // tables appear as they grow, piped too
    std::string table;
    std::vector<std::string> files;
    for (int i = 1; i < argc; ++i) {
        if (std::string(argv[i]) == "--table" && i + 1 < argc)
            table = argv[++i];
        else
            files.emplace_back(argv[i]);
    }
    const auto wanted = [&](const std::string& name) {
        return table.empty() ? name != "long" : table == name;
    };
    std::vector<Scene> scenes;
    for (const std::string& file : files) scenes.emplace_back(file, surface::read_mesh(file));
    if (files.empty()) {
        scenes.emplace_back("low", bench::low_relief());
        scenes.emplace_back("deep", bench::deep_features());
    }
    for (const Scene& s : scenes)
        fmt::print("{}: {} vertices, {} triangles\n", s.name, s.mesh.vertices.size(),
                   s.mesh.triangles.size());
    if (wanted("embree")) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        fmt::print(
            "\nMillion segments a second: the engine, and Embree alone on the same "
            "rays\n{:<10}{:>9}{:>12}{:>10}"
            "{:>10}{:>10}{:>10}{:>11}\n",
            "surface", "sticking", "segments", "engine", "1 wide", "8 wide", "16 wide", "kept");
        for (const Scene& s : scenes) against_embree(s);
    }
    if (wanted("first")) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        fmt::print(
            "\nMillion source rays a second: the first release's tracer, random and ordered source, and the "
            "engine\n{:<10}{:>9}{:>12}{:>12}{:>12}{:>12}{:>12}\n",
            "surface", "sticking", "random", "ordered", "engine", "to random", "to ordered");
        for (const Scene& s : scenes) against_first_light(s);
    }
    if (wanted("accuracy")) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        fmt::print(
            "\nCPU seconds to a noise of 2 %: the first tracer on the raw mesh (from its noise at {} rays) "
            "and the "
            "engine on simplified meshes; what these do to the flux, root mean square over the raw area, and "
            "what "
            "that must exceed to be told from noise; ratio of the seconds to 2 % of both together, "
            "simplification "
            "included\n{:<10}{:>9}  {:<16}{:>11}{:>10}{:>10}{:>10}{:>9}{:>9}{:>10}{:>10}{:>9}\n",
            kRays / 4, "surface", "sticking", "mesh", "removed", "simplify", "engine", "noise", "first",
            "ratio", "bias", "limit", "all");
        for (const Scene& s : scenes) to_two_percent(s);
    }
    if (wanted("threads")) {
        fmt::print(
            "\nWall seconds by threads, {} rays; and with 32 rays, whose share that is not parallel is the "
            "serial "
            "one\n{:<10}{:>9}{:>12}{:>12}{:>12}{:>14}{:>12}{:>12}\n",
            kRays, "surface", "sticking", "1", "2", "ratio", "32 rays, 1", "2", "serial");
        for (const Scene& s : scenes) by_threads(s);
    }
    if (wanted("species")) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        fmt::print(
            "\nTwo species: million source rays a second of each alone and of one pass for both, and the "
            "ratio "
            "of the CPU seconds; noise of each at those {} rays, alone and in the pass; the ratio at equal "
            "noise "
            "of each; CPU seconds to a noise of 5 % of each alone and of one pass for both, and their "
            "ratio\n{:<6}{:<10}{:>8}{:>8}{:>8}{:>8}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}{:>8}{:>8}{:>8}\n",
            kRays / 2, "", "stickings", "first", "second", "both", "ratio", "1 alone", "both", "2 alone",
            "both", "equal", "1 to 5%", "2 to 5%", "both", "ratio");
        for (const Scene& s : scenes) several_species(s);
    }
    if (!wanted("long")) return 0;
    fmt::print("\n1e8 rays, sticking 0.1\n{:<10}{:>12}{:>12}{:>9}{:>9}{:>10}{:>14}{:>12}\n", "surface",
               "rays", "segments", "leaked", "rescued", "ledger", "memory [MB]", "seconds");
    for (const Scene& s : scenes) many_rays(s);
}
