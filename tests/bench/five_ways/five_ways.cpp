#include "tests/bench/five_ways/five_ways.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/timing.hpp"
#include "flux/radiosity/exchange_samples.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "flux/radiosity/radiosity.hpp"
#include "flux/tracer/tracer.hpp"

namespace sidewall::bench {

using namespace app;

namespace {

using Values = std::vector<double>;
constexpr std::uint64_t kLimitSeed = 2'000'003, kLimitRepeats = 4;  // not used elsewhere; at least two
// Rays an unknown: of all repeats of a limit together, and of radiosity's first repeat.
constexpr double kMostLimitRays = 512.0, kFirstRadiosityRays = 16.0;
constexpr double kMostGathered = 5.0;  // radiosity rays of a repeat over a trace's, at most; beyond, scaled
constexpr int kTenths = 10;
constexpr double kFacesUp = 0.707;  // cosine of 45 degrees

struct Mean {
    double value = 0.0, variance = 0.0;  // variance of the mean
};

// Mean of value(repeat) over some repeats.
template <class Value>
Mean mean_over(std::size_t repeats, const Value& value) {
    const auto count = static_cast<double>(repeats);
    Mean mean;
    for (std::size_t k = 0; k < repeats; ++k) mean.value += value(k) / count;
    for (std::size_t k = 0; k < repeats; ++k)
        mean.variance += std::pow(value(k) - mean.value, 2.0) / (count * std::max(1.0, count - 1.0));
    return mean;
}

// A mesh on which both methods find the flux.
struct TracedMesh {
    const SimplifiedMesh& of;
    MeshFlux flux;
    // Limits of either method with ever more rays, at the vertices of the surface, by repeat.
    std::vector<Values> top_down_limit, radiosity_limit;
};

// The comparison of methods at one sticking probability.
struct Case {
    const FiveWaysOptions& options;
    double sticking;
    std::span<const DepthBin> bins;
    std::span<const TracedMesh> meshes;  // the first is raw
    DepthError error(const DepthBin& bin, const FluxRuns& runs) const {
        return depth_error(bin, runs, meshes.front().top_down_limit, options.target);
    }
};

// Mean over the hat function of every wedge.
Values hat_means(const MeshFlux& on, const Values& flux) {
    const flux::WedgeMatrix mass = flux::mass_matrix(on.mesh, on.wedges);
    Values means(flux.size(), 0.0);
    for (std::size_t i = 0; i < means.size(); ++i) {
        double area = 0.0;
        for (flux::WedgeMatrix::InnerIterator entry(mass, i); entry; ++entry) {
            means[i] += entry.value() * flux[entry.col()];
            area += entry.value();
        }
        means[i] = area > 0.0 ? means[i] / area : flux[i];
    }
    return means;
}

void find_limits(const FiveWaysOptions& options, double sticking, TracedMesh& mesh) {
    const double most = kMostLimitRays * static_cast<double>(mesh.flux.wedges.count()),
                 rays = std::min(options.reference_rays, most) / kLimitRepeats;
    mesh.top_down_limit.clear();
    mesh.radiosity_limit.clear();
    for (std::uint64_t repeat = 0; repeat < kLimitRepeats; ++repeat) {
        options.before_turn(fmt::format("five ways, {}, reference", mesh.of.name));
        double untimed = 0.0;
        const Values flux = mesh.flux.solved(rays, sticking, kLimitSeed + repeat, false, untimed);
        mesh.radiosity_limit.push_back(mesh.flux.at_vertices(flux));
        mesh.top_down_limit.push_back(mesh.flux.at_vertices(hat_means(mesh.flux, flux)));
    }
}

// Two repeats of either method on a mesh.
FluxRuns repeated(const Case& c, const TracedMesh& mesh, double rays, bool radiosity) {
    const MeshFlux& on = mesh.flux;
    FluxRuns runs{.limit = radiosity ? mesh.radiosity_limit : mesh.top_down_limit,
                  .rays = rays,
                  .fixed_seconds = mesh.of.seconds + on.bvh_seconds + on.wedge_seconds};
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        c.options.before_turn(
            fmt::format("five ways, {}, {}", mesh.of.name, radiosity ? "radiosity" : "tracing"));
        runs.values.push_back(on.at_vertices(radiosity ? on.solved(rays, c.sticking, seed, true, runs.seconds)
                                                       : on.traced(rays, c.sticking, seed, runs.seconds)));
    }
    runs.seconds *= 0.5;
    return runs;
}

// Radiosity with the rays doubled until it reaches the target at every depth.
FluxRuns radiosity_runs(const Case& c, const TracedMesh& mesh) {
    const double fewest = kFirstRadiosityRays * static_cast<double>(mesh.flux.wedges.count());
    for (double rays = fewest;; rays *= 2.0) {
        FluxRuns runs = repeated(c, mesh, rays, true);
        runs.fewest_rays = fewest;
        const auto reached = [&](const DepthBin& bin) { return c.error(bin, runs).rays <= rays; };
        if (2.0 * rays > kMostGathered * c.options.rays || std::ranges::all_of(c.bins, reached)) return runs;
    }
}

Json way_json(const Case& c, const char* way, const std::string& variant, const FluxRuns& runs) {
    Json by_depth = Json::array();
    double slowest = 0.0, bias = 0.0;
    for (const DepthBin& bin : c.bins) {
        const DepthError error = c.error(bin, runs);
        slowest = std::max(slowest, error.seconds);
        bias = std::max(bias, error.bias);
        by_depth.push_back({{"depth", bin.name},
                            {"flux", error.flux},
                            {"reference_error", error.reference_error},
                            {"bias", error.bias},
                            {"noise", error.noise},
                            {"shift", error.shift},
                            {"seconds", number_or_null(error.seconds)}});
    }
    return Json{{"way", way},
                {"variant", variant},
                {"rays", runs.rays},
                {"run_seconds", {{"fixed", runs.fixed_seconds}, {"of_rays", runs.seconds}}},
                {"by_depth", std::move(by_depth)},
                {"bias", bias},
                {"seconds", number_or_null(slowest)}};
}

// Adds top-down fluxes that are averaged over neighbours in more and more rounds.
void add_smoothed_ways(const Case& c, FluxRuns runs, Json& ways) {
    const TriangleMesh& surface = c.meshes.front().of.mesh;
    int done = 0;
    for (const int rounds : {1, 4, 8, 16, 32, 64, 128, 256}) {
        c.options.before_turn(fmt::format("five ways, raw, {} rounds of averaging", rounds));
        const double start = cpu_seconds();
        for (Values& values : runs.values) values = smoothed(std::move(values), surface, rounds - done);
        runs.fixed_seconds += 0.5 * (cpu_seconds() - start);
        for (Values& values : runs.limit) values = smoothed(std::move(values), surface, rounds - done);
        done = rounds;
        ways.push_back(way_json(c, "raw top-down, smoothed",
                                fmt::format("{} round{}", rounds, rounds > 1 ? "s" : ""), runs));
    }
}

// Marks one variant of every method: the fastest, or the least biased where none reaches the target.
void mark_best(Json& ways) {
    const auto order = [](const Json& way) {
        return std::pair{way["seconds"].is_null() ? kInfinity : way["seconds"].get<double>(),
                         way["bias"].get<double>()};
    };
    for (Json& way : ways)
        way["best"] = std::ranges::none_of(
            ways, [&](const Json& other) { return other["way"] == way["way"] && order(other) < order(way); });
}

Json case_json(const Case& c) {
    Json ways = Json::array();
    for (const TracedMesh& mesh : c.meshes) {
        const bool raw = &mesh == &c.meshes.front();
        const std::string variant = raw ? "" : mesh.of.name;
        const FluxRuns runs = repeated(c, mesh, 0.5 * c.options.rays, false);
        ways.push_back(way_json(c, raw ? "raw top-down" : "simplified top-down", variant, runs));
        if (raw) add_smoothed_ways(c, runs, ways);
        ways.push_back(
            way_json(c, raw ? "raw radiosity" : "simplified radiosity", variant, radiosity_runs(c, mesh)));
    }
    mark_best(ways);
    return Json{{"sticking", c.sticking}, {"target", c.options.target}, {"ways", std::move(ways)}};
}

// Returns make() and adds the CPU seconds that it takes.
template <class Make>
auto timed(double& seconds, Make&& make) {
    const double start = cpu_seconds();
    auto made = make();
    seconds += cpu_seconds() - start;
    return made;
}

// Seconds to the target at every depth, and the variant.
std::string way_text(const Json& way) {
    const std::string text = way["seconds"].is_null()
                                 ? fmt::format("not reached ({:.2g} %)", 100.0 * way["bias"].get<double>())
                                 : fmt::format("{:.3g}", way["seconds"]);
    return way["variant"] == "" ? text : fmt::format("{} ({})", text, way["variant"]);
}

// How many times as fast the fastest way with simplification is as the fastest without.
double gain(const Json& entry) {
    double raw = kInfinity, simplified = kInfinity;
    for (const Json& way : entry["ways"]) {
        double& least = way["way"].get<std::string>().starts_with("simplified") ? simplified : raw;
        if (!way["seconds"].is_null()) least = std::min(least, way["seconds"].get<double>());
    }
    return raw / simplified;
}

}  // namespace

std::string five_ways_table(const std::string& surface, const Json& entries) {
    const std::vector<std::string> names{"surface, sticking",
                                         "raw top-down",
                                         "raw top-down, smoothed",
                                         "simplified top-down",
                                         "raw radiosity",
                                         "simplified radiosity",
                                         "simplification pays, times as fast"};
    std::string table = fmt::format("| {} |\n", fmt::join(names, " | "));
    for (const Json& entry : entries) {
        std::vector<std::string> cells;
        for (const std::string& name : names)
            for (const Json& way : entry["ways"])
                if (way["way"] == name && way["best"] == true) cells.push_back(way_text(way));
        table += fmt::format("| {}, {:.3g} | {} | {:.2g} |\n", surface, entry["sticking"],
                             fmt::join(cells, " | "), gain(entry));
    }
    return table;
}

std::string depth_table(const Json& entry) {
    std::vector<std::vector<std::string>> rows{{"depth", "flux"}};
    for (const Json& depth : entry["ways"][0]["by_depth"])
        rows.push_back({depth["depth"], fmt::format("{:.2g}", depth["flux"])});
    for (const Json& way : entry["ways"]) {
        if (way["best"] != true) continue;
        rows[0].push_back(way["way"]);
        for (std::size_t k = 1; k < rows.size(); ++k) {
            const Json& seconds = way["by_depth"][k - 1]["seconds"];
            rows[k].push_back(seconds.is_null() ? "not reached" : fmt::format("{:.3g}", seconds));
        }
    }
    std::string table;
    for (const auto& row : rows) table += fmt::format("| {} |\n", fmt::join(row, " | "));
    return table;
}

std::vector<DepthBin> depth_bins(const TriangleMesh& surface) {
    std::vector<Vec3> normal(surface.vertices.size(), Vec3::Zero());
    std::vector<double> area(surface.vertices.size(), 0.0);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t]) {
            normal[v] += area_vector(surface, t);
            area[v] += triangle_area(surface, t) / 3.0;
        }
    const Box3 box = bounding_box(surface);
    const double step = box.size().z() / kTenths;
    std::vector<DepthBin> bins(kTenths + 1, {"floor", {}, {}});
    for (int n = 0; n < kTenths; ++n)
        bins[static_cast<std::size_t>(n)].name = fmt::format("{} to {} %", 10 * n, 10 * (n + 1));
    for (std::uint32_t v = 0; v < surface.vertices.size(); ++v) {
        const double below = box.max.z() - surface.vertices[v].z();
        const int tenth = step > 0.0 ? std::min(kTenths - 1, static_cast<int>(below / step)) : kTenths - 1;
        const bool floor = tenth == kTenths - 1 && normal[v].z() > kFacesUp * normal[v].norm();
        DepthBin& bin = floor ? bins.back() : bins[static_cast<std::size_t>(tenth)];
        bin.vertices.push_back(v);
        bin.area.push_back(area[v]);
    }
    std::erase_if(bins, [](const DepthBin& bin) { return bin.vertices.empty(); });
    return bins;
}

DepthError depth_error(const DepthBin& bin, const FluxRuns& runs,
                       std::span<const std::vector<double>> reference, double target) {
    const std::size_t repeats = reference.size();
    const auto count = static_cast<double>(runs.values.size());
    double area = 0.0, flux = 0.0, own = 0.0, square = 0.0, noise = 0.0, scatter = 0.0, bias = 0.0;
    for (std::size_t i = 0; i < bin.vertices.size(); ++i) {
        const std::uint32_t v = bin.vertices[i];
        const double a = bin.area[i];
        const Mean truth = mean_over(repeats, [&](std::size_t k) { return reference[k][v]; }),
                   end = mean_over(repeats, [&](std::size_t k) { return runs.limit[k][v]; }),
                   off =
                       mean_over(repeats, [&](std::size_t k) { return runs.limit[k][v] - reference[k][v]; });
        area += a;
        flux += a * truth.value;
        square += a * (truth.value * truth.value - truth.variance);
        scatter += a * truth.variance;
        bias += a * (off.value * off.value - off.variance);
        for (const std::vector<double>& repeat : runs.values) {
            own += a * repeat[v] / count;
            noise += a * (std::pow(repeat[v] - end.value, 2.0) - end.variance) / count;
        }
    }
    const auto relative = [&](double sum) {
        return square > 0.0 ? std::sqrt(std::max(0.0, sum) / square) : kInfinity;
    };
    DepthError error{.flux = flux / area,
                     .bias = relative(bias),
                     .noise = relative(noise),
                     .reference_error = relative(scatter),
                     .shift = own / flux - 1.0};
    // Noise falls with the root of the rays.
    if (const double left = target * target - error.bias * error.bias; left > 0.0) {
        error.rays = std::max(runs.fewest_rays, runs.rays * error.noise * error.noise / left);
        error.seconds = runs.fixed_seconds + runs.seconds * error.rays / runs.rays;
    }
    return error;
}

Json five_ways(std::span<const SimplifiedMesh> meshes, const flux::LateralBox& box,
               const FiveWaysOptions& options) {
    const TriangleMesh& surface = meshes.front().mesh;
    const std::vector<DepthBin> bins = depth_bins(surface);
    std::vector<TracedMesh> traced;
    for (const SimplifiedMesh& mesh : meshes)
        traced.push_back({mesh, MeshFlux(mesh.mesh, surface, box), {}, {}});
    Json entries = Json::array();
    for (const double sticking : options.stickings) {
        for (TracedMesh& mesh : traced) find_limits(options, sticking, mesh);
        entries.push_back(case_json({options, sticking, bins, traced}));
    }
    return entries;
}

MeshFlux::MeshFlux(const TriangleMesh& traced_mesh, const TriangleMesh& surface,
                   const flux::LateralBox& lateral)
    : mesh(traced_mesh),
      box(lateral),
      scene(timed(bvh_seconds, [&] { return surface::RayScene(mesh); })),
      wedges(timed(wedge_seconds, [&] { return flux::make_wedges(mesh); })),
      nearest(surface.vertices.size()) {
    tbb::parallel_for(std::size_t{0}, nearest.size(), [&](std::size_t n) {
        nearest[n] = scene.closest_point(surface.vertices[n], kInfinity);
    });
}

std::vector<double> MeshFlux::traced(double rays, double sticking, std::uint64_t seed,
                                     double& seconds) const {
    const flux::TraceOptions options{
        .rays = static_cast<std::uint64_t>(rays), .seed = seed, .stop = interrupted};
    return timed(seconds, [&] {
        return flux::trace_flux(mesh, scene, box, {.sticking = {sticking}}, {}, wedges, options).wedge.flux;
    });
}

std::vector<double> MeshFlux::solved(double rays, double sticking, std::uint64_t seed, bool errors,
                                     double& seconds) const {
    constexpr double kTolerance = 1e-4;  // the tolerance of solve_fluxes_to for 2 %
    const auto most = static_cast<std::uint64_t>(rays);
    return timed(seconds, [&] {
        const std::vector<double> everywhere(wedges.count(), sticking);
        const flux::DiffuseSpecies species{.sticking = everywhere};
        flux::Exchange exchange(
            mesh, scene, box, wedges, {1.0},
            {.seed = seed, .most_bytes = flux::exchange_bytes(most + 1), .stop = interrupted});
        flux::gather_for({&species, 1}, exchange, most, {.stop = interrupted});
        return flux::solve_flux(exchange, species,
                                {.tolerance = kTolerance, .errors = errors, .stop = interrupted})
            .wedge.flux;
    });
}

std::vector<double> MeshFlux::at_vertices(std::span<const double> by_wedge) const {
    std::vector<double> values(nearest.size());
    for (std::size_t n = 0; n < nearest.size(); ++n)
        values[n] = flux::interpolate(wedges, by_wedge, nearest[n].triangle, nearest[n].u, nearest[n].v);
    return values;
}

std::vector<double> smoothed(std::vector<double> values, const TriangleMesh& surface, int rounds) {
    const std::vector<Vec3> normals = triangle_normals(surface);
    // A triangle contributes only where it lies within 40 degrees of the vertex's normal: creases stay sharp.
    std::vector<Vec3> vertex_normal(surface.vertices.size(), Vec3::Zero());
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t]) vertex_normal[v] += area_vector(surface, t);
    for (Vec3& n : vertex_normal) n.normalize();
    constexpr double kInLine = 0.766;  // cos 40 degrees
    for (int round = 0; round < rounds; ++round) {
        std::vector<double> sum(values.size(), 0.0), weight(values.size(), 0.0);
        for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
            const auto [a, b, c] = surface.triangles[t];
            const double area = triangle_area(surface, t);
            const double mean = (values[a] + values[b] + values[c]) / 3.0;
            for (const std::uint32_t v : {a, b, c}) {
                if (vertex_normal[v].dot(normals[t]) < kInLine) continue;
                sum[v] += area * mean;
                weight[v] += area;
            }
        }
        for (std::size_t v = 0; v < values.size(); ++v)
            if (weight[v] > 0.0) values[v] = sum[v] / weight[v];
    }
    return values;
}

}  // namespace sidewall::bench
