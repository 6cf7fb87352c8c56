#include "app/evaluation/five_ways.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/timing.hpp"
#include "app/evaluation/flux_runs.hpp"
#include "app/evaluation/study_flux.hpp"
#include "flux/radiosity/exchange_samples.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

using Values = std::vector<double>;
constexpr std::uint64_t kLimitSeed = 2'000'003;  // away from the seeds of what is compared with it
constexpr std::uint64_t kLimitRepeats = 4;       // at least two
// Rays an unknown: of all repeats of a limit, and of one of radiosity's to begin with.
constexpr double kMostLimitRays = 512.0, kFirstRadiosityRays = 16.0;
constexpr double kMostGathered = 5.0;  // rays of one repeat over those of a trace; what lies beyond is scaled

/// A way in one variant, with more and more rays.
struct Way {
    const char* name;
    std::string variant;
    std::vector<FluxRuns> levels;
};

// Mean over the hat function of every wedge.
Values hat_means(const TriangleMesh& mesh, const flux::Wedges& wedges, const Values& flux) {
    const flux::MassMatrix mass = flux::mass_matrix(mesh, wedges);
    Values means(flux.size(), 0.0);
    for (std::size_t i = 0; i < means.size(); ++i) {
        double area = 0.0;
        for (std::uint32_t k = mass.first[i]; k < mass.first[i + 1]; ++k) {
            means[i] += mass.value[k] * flux[mass.column[k]];
            area += mass.value[k];
        }
        means[i] = area > 0.0 ? means[i] / area : flux[i];
    }
    return means;
}

// A mesh on which both methods find the flux.
struct TracedMesh {
    std::string name;  // empty: raw
    double seconds;
    std::unique_ptr<PairTrace> trace;
};

std::string label(const TracedMesh& mesh) {
    return mesh.name.empty() ? "raw" : mesh.name;
}

// What both methods come to on a mesh with ever more rays, at the vertices of the surface, by repeat.
struct Limits {
    std::vector<Values> top_down, radiosity;
};

// By sticking.
std::vector<Limits> limits_on(const TracedMesh& mesh, const FiveWaysOptions& options) {
    const PairTrace& trace = *mesh.trace;
    std::vector<Values> everywhere;
    for (const double sticking : options.stickings) everywhere.emplace_back(trace.wedges().count(), sticking);
    std::vector<flux::DiffuseSpecies> species;
    species.reserve(everywhere.size());
    for (const Values& sticking : everywhere) species.push_back({.sticking = sticking});
    const auto rays = static_cast<std::uint64_t>(
        std::min(options.reference_rays, kMostLimitRays * static_cast<double>(trace.wedges().count())) /
        kLimitRepeats);
    std::vector<Limits> limits(species.size());
    for (std::uint64_t repeat = 0; repeat < kLimitRepeats; ++repeat) {
        options.before_turn(fmt::format("five ways, {}, reference", label(mesh)));
        flux::Exchange exchange(
            trace.mesh(), trace.scene(), trace.box(), trace.wedges(), {1.0},
            {.seed = kLimitSeed + repeat, .most_bytes = flux::exchange_bytes(rays + 1), .stop = interrupted});
        flux::gather_for(species, exchange, rays, {.stop = interrupted});
        for (std::size_t k = 0; k < species.size(); ++k) {
            const flux::RadiosityFlux solved =
                flux::solve_flux(exchange, species[k], {.errors = false, .stop = interrupted});
            limits[k].radiosity.push_back(trace.at_vertices(solved.wedge.flux));
            limits[k].top_down.push_back(
                trace.at_vertices(hat_means(trace.mesh(), trace.wedges(), solved.wedge.flux)));
        }
    }
    return limits;
}

FluxRuns runs_of(FluxPair pair, double fixed_seconds, std::vector<Values> limit) {
    FluxRuns runs;
    runs.limit = std::move(limit);
    runs.rays = 0.5 * pair.rays;
    runs.seconds = 0.5 * pair.trace_seconds;
    runs.fixed_seconds = fixed_seconds + pair.bvh_seconds + pair.wedge_seconds;
    runs.values.push_back(std::move(pair.first));
    runs.values.push_back(std::move(pair.second));
    return runs;
}

// The ways to the flux of one sticking.
struct Case {
    const TriangleMesh& surface;
    const FiveWaysOptions& options;
    std::span<const DepthBin> bins;
    double sticking;
    std::span<const TracedMesh> meshes;  // the first is raw
    std::span<const Limits> limits;      // by mesh
    const FluxPair* long_run;            // or nullptr
    std::span<const Values> reference() const { return limits.front().top_down; }
};

// Error and time of a way at one depth, with as few rays as get there.
struct AtDepth {
    DepthError error;
    double rays = 0.0;  // that it had
    double seconds = kInfinity;
    bool reached = false;  // with those rays
};

AtDepth at_depth(const Case& c, const Way& way, const DepthBin& bin) {
    AtDepth result;
    for (const FluxRuns& level : way.levels) {
        double rays = 0.0;
        result.error = depth_error(bin, level, c.reference());
        result.seconds = seconds_to(c.options.target, level, result.error, rays);
        result.rays = level.rays;
        result.reached = rays <= level.rays;
        if (result.reached) break;
    }
    return result;
}

// The same averaged over neighbours more and more often.
void add_smoothed_ways(const Case& c, FluxPair pair, std::vector<Way>& ways) {
    std::vector<Values> limit(c.reference().begin(), c.reference().end());
    double seconds = 0.0;
    int done = 0;
    for (const int rounds : {1, 4, 8, 16, 32, 64, 128, 256}) {
        c.options.before_turn(fmt::format("five ways, raw, {} rounds of averaging", rounds));
        const double start = cpu_seconds();
        pair = smoothed(pair, c.surface, rounds - done);
        seconds += 0.5 * (cpu_seconds() - start);
        for (Values& repeat : limit) repeat = smoothed(std::move(repeat), c.surface, rounds - done);
        done = rounds;
        ways.push_back({"raw top-down, smoothed",
                        fmt::format("{} round{}", rounds, rounds > 1 ? "s" : ""),
                        {runs_of(pair, seconds, limit)}});
    }
}

std::vector<Way> top_down_ways(const Case& c) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed)
        for (const TracedMesh& mesh : c.meshes) {
            c.options.before_turn(fmt::format("five ways, {}, tracing", label(mesh)));
            mesh.trace->turn(c.options.rays, c.sticking, seed);
        }
    std::vector<Way> ways;
    for (std::size_t m = 0; m < c.meshes.size(); ++m) {
        const TracedMesh& mesh = c.meshes[m];
        const FluxPair pair = mesh.trace->take();
        ways.push_back({m == 0 ? "raw top-down" : "simplified top-down",
                        mesh.name,
                        {runs_of(pair, mesh.seconds, c.limits[m].top_down)}});
        if (m == 0) add_smoothed_ways(c, pair, ways);
    }
    return ways;
}

// With more and more rays, until it gets there at every depth.
Way radiosity_way(const Case& c, std::size_t m) {
    const TracedMesh& mesh = c.meshes[m];
    Way way{m == 0 ? "raw radiosity" : "simplified radiosity", mesh.name, {}};
    const auto unknowns = static_cast<double>(mesh.trace->wedges().count());
    for (double rays = kFirstRadiosityRays * unknowns;
         way.levels.empty() || rays <= kMostGathered * c.options.rays; rays *= 2.0) {
        for (std::uint64_t seed = 1; seed <= 2; ++seed) {
            c.options.before_turn(fmt::format("five ways, {}, radiosity", label(mesh)));
            mesh.trace->turn(2.0 * rays, c.sticking, seed, true);
        }
        way.levels.push_back(runs_of(mesh.trace->take(), mesh.seconds, c.limits[m].radiosity));
        way.levels.back().fewest_rays = way.levels.front().rays;  // but for rounding what was asked for
        if (std::ranges::all_of(c.bins, [&](const DepthBin& bin) { return at_depth(c, way, bin).reached; }))
            break;
    }
    return way;
}

Json seconds_json(double seconds) {
    return std::isfinite(seconds) ? Json(seconds) : Json(nullptr);
}

Json way_json(const Case& c, const Way& way) {
    Json by_depth = Json::array();
    double seconds = 0.0;
    int reached = 0;
    for (const DepthBin& bin : c.bins) {
        const AtDepth at = at_depth(c, way, bin);
        reached += std::isfinite(at.seconds) ? 1 : 0;
        seconds = std::max(seconds, at.seconds);
        by_depth.push_back({{"bias", at.error.bias},
                            {"noise", at.error.noise},
                            {"shift", at.error.shift},
                            {"bias_resolved", at.error.bias_resolved},
                            {"rays", at.rays},
                            {"seconds", seconds_json(at.seconds)}});
    }
    const FluxRuns& last = way.levels.back();
    return Json{{"way", way.name},
                {"variant", way.variant},
                {"best", false},
                {"rays", last.rays},
                {"run_seconds", {{"fixed", last.fixed_seconds}, {"of_rays", last.seconds}}},
                {"by_depth", std::move(by_depth)},
                {"seconds", seconds_json(seconds)},
                {"reached", reached}};
}

// Marks one variant of every way: the one that gets there at the most depths, then the fastest, or the least
// biased.
void mark_best(Json& ways) {
    const auto order = [](const Json& way) {
        double bias = 0.0;
        for (const Json& depth : way["by_depth"]) bias = std::max(bias, depth["bias"].get<double>());
        return std::pair{-way["reached"].get<int>(),
                         way["seconds"].is_null() ? bias : way["seconds"].get<double>()};
    };
    for (Json& way : ways)
        way["best"] = std::ranges::none_of(
            ways, [&](const Json& other) { return other["way"] == way["way"] && order(other) < order(way); });
}

Json case_json(const Case& c) {
    std::vector<Way> ways = top_down_ways(c);
    for (std::size_t m = 0; m < c.meshes.size(); ++m) ways.push_back(radiosity_way(c, m));
    FluxRuns longest = ways.front().levels.front();
    if (c.long_run != nullptr) longest.values = {c.long_run->first, c.long_run->second};
    Json depths = Json::array();
    for (const DepthBin& bin : c.bins) {
        const DepthError error = depth_error(bin, longest, c.reference());
        depths.push_back({{"name", bin.name},
                          {"z_low", bin.z_low},
                          {"z_high", bin.z_high},
                          {"flux", error.flux},
                          {"reference_error", error.reference_error},
                          {"shift", error.shift}});
    }
    Json json{{"sticking", c.sticking},
              {"target", c.options.target},
              {"depths", std::move(depths)},
              {"ways", Json::array()}};
    for (const Way& way : ways) json["ways"].push_back(way_json(c, way));
    mark_best(json["ways"]);
    return json;
}

}  // namespace

Json five_ways(const TriangleMesh& surface, const flux::LateralBox& box,
               std::span<const SimplifiedMesh> simplified, const FiveWaysOptions& options) {
    std::vector<TracedMesh> meshes;
    meshes.push_back({"", 0.0, std::make_unique<PairTrace>(surface, surface, box)});
    for (const SimplifiedMesh& mesh : simplified)
        meshes.push_back({mesh.name, mesh.seconds, std::make_unique<PairTrace>(mesh.mesh, surface, box)});
    std::vector<std::vector<Limits>> limits(options.stickings.size());
    for (const TracedMesh& mesh : meshes) {
        std::vector<Limits> of_mesh = limits_on(mesh, options);
        for (std::size_t k = 0; k < limits.size(); ++k) limits[k].push_back(std::move(of_mesh[k]));
    }
    const std::vector<DepthBin> bins = depth_bins(surface);
    Json entries = Json::array();
    for (std::size_t k = 0; k < limits.size(); ++k)
        entries.push_back(case_json({surface, options, bins, options.stickings[k], meshes, limits[k],
                                     k == 0 ? options.long_run : nullptr}));
    return entries;
}

}  // namespace sidewall::app
