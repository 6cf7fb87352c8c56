#include "app/evaluation/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/progress.hpp"
#include "app/common/threads.hpp"
#include "app/common/timing.hpp"
#include "app/common/version.hpp"
#include "app/evaluation/five_ways.hpp"
#include "app/evaluation/study_flux.hpp"
#include "app/process/simulation.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/quality.hpp"

namespace sidewall::app {
namespace {

// A method as the report names it.
struct Method {
    const char* name;
    simplify::Method method;
    simplify::Weights weights;
    bool traced = true;      // CGAL's meshes are Lindstrom-Turk's: they are not traced again
    bool automatic = false;  // feature parameter from the distribution of curvature, not 0.5
};

const Method kMethods[] = {
    {"lindstrom-turk 0.5/0.5/0", simplify::Method::lindstrom_turk, simplify::kVolumeWeights},
    {"lindstrom-turk 0.4/0.3/0.3", simplify::Method::lindstrom_turk, simplify::kShapeWeights},
    {"region", simplify::Method::region, simplify::kVolumeWeights},
    {"region-bounded", simplify::Method::region_bounded, simplify::kVolumeWeights},
    {"region (C auto)", simplify::Method::region, simplify::kVolumeWeights, false, true},
    {"region-bounded (C auto)", simplify::Method::region_bounded, simplify::kVolumeWeights, false, true},
    {"cgal-lindstrom-turk 0.5/0.5/0", simplify::Method::cgal_lindstrom_turk, simplify::kVolumeWeights, false},
    {"cgal-lindstrom-turk 0.4/0.3/0.3", simplify::Method::cgal_lindstrom_turk, simplify::kShapeWeights,
     false},
};

bool uses_features(simplify::Method method) {
    return method == simplify::Method::region || method == simplify::Method::region_bounded;
}

// Up to half of the vertices the features stay untouched, beyond they are coarsened too.
constexpr double kSparedFeatures = 0.5;

struct Surface {
    int number;
    TriangleMesh mesh;
    double spacing;
    flux::LateralBox box;
};

// The vertices that count as features, and the parameter C that made them ones.
struct Features {
    std::vector<std::uint8_t> flags;
    double parameter = 0.5;
};

Features find_features(const TriangleMesh& mesh, double spacing, bool automatic) {
    Features features;
    const surface::Curvature curvature = surface::mesh_curvature(mesh);
    if (automatic)
        features.parameter = surface::auto_feature_parameter(curvature.mean, curvature.gaussian, spacing);
    features.flags = surface::feature_flags(curvature, spacing, features.parameter);
    return features;
}

// One method at one removal. Seconds are CPU seconds, one entry a turn.
struct Trial {
    const Method* method;
    TriangleMesh mesh;
    std::vector<double> features, collapse;
    std::optional<PairTrace> trace;  // of the mesh, if it is traced
};

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                     values.end());
    return values[values.size() / 2];
}

void simplify_once(const Surface& surface, double removal, Trial& trial) {
    const Method& method = *trial.method;
    simplify::Options options;
    options.method = method.method;
    options.weights = method.weights;
    options.grid_spacing = surface.spacing;
    options.target_vertices = static_cast<std::size_t>(
        std::lround((1.0 - removal) * static_cast<double>(surface.mesh.vertices.size())));
    if (uses_features(method.method)) options.l0 = removal <= kSparedFeatures ? 0.0 : surface.spacing;
    const double start = cpu_seconds();
    std::vector<std::uint8_t> flags;
    if (uses_features(method.method))
        flags = find_features(surface.mesh, surface.spacing, method.automatic).flags;
    const double found = cpu_seconds();
    trial.mesh = simplify::simplify(surface.mesh, flags, options).mesh;
    trial.features.push_back(found - start);
    trial.collapse.push_back(cpu_seconds() - found);
}

// Distances in grid spacings: maximum, mean, and how they are spread.
Json distance_json(surface::Distance distance, double spacing) {
    Json json{{"max", distance.max / spacing}, {"mean", distance.mean / spacing}};
    std::vector<double>& d = distance.per_vertex;
    std::sort(d.begin(), d.end());
    for (const auto& [name, share] : {std::pair{"p50", 0.5}, {"p90", 0.9}, {"p99", 0.99}, {"p999", 0.999}})
        json[name] =
            d[std::min(d.size() - 1, static_cast<std::size_t>(share * static_cast<double>(d.size())))] /
            spacing;
    return json;
}

// Share of the vertices farther than each of a geometric series of distances, for Figures 8.8 to 8.11.
Json exceedance(const surface::Distance& distance, double spacing) {
    Json json = Json::array();
    for (int n = -12; n <= 4; ++n) {
        const double limit = std::pow(10.0, 0.25 * n);  // dx
        const auto count = std::count_if(distance.per_vertex.begin(), distance.per_vertex.end(),
                                         [&](double d) { return d > limit * spacing; });
        json.push_back({limit, static_cast<double>(count) / static_cast<double>(distance.per_vertex.size())});
    }
    return json;
}

Json trace_json(const FluxPair& pair, const FluxTruth& truth, double target) {
    return Json{{"rays", pair.rays},
                {"segments", pair.segments},
                {"seconds", {{"bvh", pair.bvh_seconds}, {"trace", pair.trace_seconds}}},
                {"flux_error", flux_error(pair, truth, target)}};
}

void write_coloured(const std::filesystem::path& path, TriangleMesh mesh, const std::vector<double>& distance,
                    double spacing) {
    mesh.vertex_attributes = {{"distance", 1, Scalar::float32, distance}};
    surface::write_mesh(path, mesh,
                        {.texts = {{"length_unit", "um"}, {"distance", "to the other mesh, length unit"}},
                         .numbers = {{"grid_spacing", spacing}}});
}

// Everything the report shows of one method at one removal.
// \param raw  the raw mesh, traced in turns with the others.
Json measure(const Surface& surface, const FluxTruth& truth, const Trial& trial, const FluxPair& raw,
             double removal, const StudyOptions& options) {
    const Method& method = *trial.method;
    const auto distance = surface::two_sided_distance(surface.mesh, trial.mesh);
    const auto quality = surface::measure_quality(trial.mesh);
    Json row{{"surface", surface.number},
             {"method", method.name},
             {"removal", removal},
             {"vertices", trial.mesh.vertices.size()},
             {"triangles", trial.mesh.triangles.size()},
             {"seconds", {{"features", median(trial.features)}, {"collapse", median(trial.collapse)}}},
             {"original_to_simplified", distance_json(distance.forward, surface.spacing)},
             {"simplified_to_original", distance_json(distance.backward, surface.spacing)},
             {"exceedance", exceedance(distance.forward, surface.spacing)},
             {"quality",
              {{"min_angle_deg", quality.min_angle_deg},
               {"mean_ratio_mean", quality.mean_ratio_mean},
               {"slivers", quality.slivers}}}};
    if (uses_features(method.method))
        row["schedule"] = {{"l0", removal <= kSparedFeatures ? 0.0 : 1.0}, {"step", 1.0}};  // dx
    if (!trial.trace) return row;
    row["trace"] = trace_json(trial.trace->pair, truth, options.flux_error);
    row["trace"]["seconds"]["raw"] = raw.trace_seconds;
    constexpr double kShown = 0.9;
    if (std::abs(removal - kShown) < 1e-9) {
        std::string name = method.name;
        std::replace_if(
            name.begin(), name.end(), [](char c) { return c == ' ' || c == '/'; }, '-');
        const auto file = [&](const char* what) {
            return options.output / fmt::format("surface{}_{}_{}.vtp", surface.number, name, what);
        };
        write_coloured(file("simplified"), trial.mesh, distance.backward.per_vertex, surface.spacing);
        write_coloured(file("original"), surface.mesh, distance.forward.per_vertex, surface.spacing);
    }
    return row;
}

Json measure_raw(const Surface& surface, const FluxTruth& truth, const StudyOptions& options) {
    constexpr std::uint64_t kSeed = 1;
    const FluxPair pair = trace_pair(surface.mesh, surface.mesh, surface.box, options.rays, options.sticking,
                                     kSeed, options.radiosity);
    Json raw = trace_json(pair, truth, options.flux_error);
    raw["smoothed"] = Json::array();
    for (const int rounds : {1, 4, 16, 64}) {
        const double start = cpu_seconds();
        const FluxPair smooth = smoothed(pair, surface.mesh, rounds);
        const double seconds = 0.5 * (cpu_seconds() - start);
        raw["smoothed"].push_back({{"rounds", rounds},
                                   {"seconds", seconds},
                                   {"flux_error", flux_error(smooth, truth, options.flux_error)}});
    }
    return raw;
}

using BeforeTurn = std::function<void(const std::string&)>;  // told before each turn

// All methods at one removal, in turns, so that times of one set were taken side by side.
// \param kept  gets the meshes that the five ways are compared on.
Json measure_set(const Surface& surface, const FluxTruth& truth, double removal, const StudyOptions& options,
                 const BeforeTurn& before_turn, std::vector<SimplifiedMesh>& kept) {
    const std::string set = fmt::format("{:.0f} %", 100.0 * removal);
    std::vector<Trial> trials;
    for (const Method& method : kMethods) trials.push_back({&method, {}, {}, {}, {}});
    for (int turn = 0; turn < std::max(1, options.repeats); ++turn)
        for (Trial& trial : trials) {
            // CGAL's times are for comparison alone.
            if (turn > 0 && !trial.method->traced) continue;
            before_turn(fmt::format("{} {}", set, trial.method->name));
            simplify_once(surface, removal, trial);
        }
    PairTrace raw(surface.mesh, surface.mesh, surface.box);
    for (Trial& trial : trials)
        if (trial.method->traced) trial.trace.emplace(trial.mesh, surface.mesh, surface.box);
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        before_turn(fmt::format("{} raw, tracing", set));
        raw.turn(options.rays, options.sticking, seed, options.radiosity);
        for (Trial& trial : trials) {
            if (!trial.trace) continue;
            before_turn(fmt::format("{} {}, tracing", set, trial.method->name));
            trial.trace->turn(options.rays, options.sticking, seed, options.radiosity);
        }
    }
    Json rows = Json::array();
    for (const Trial& trial : trials)
        rows.push_back(measure(surface, truth, trial, raw.pair, removal, options));
    for (Trial& trial : trials)
        if (trial.method->traced && trial.method->weights.shape == 0.0 && removal == options.removals.back())
            kept.push_back({fmt::format("{}, {:.0f} %", trial.method->name, 100.0 * removal),
                            std::move(trial.mesh), median(trial.features) + median(trial.collapse)});
    return rows;
}

FiveWaysOptions five_ways_options(const StudyOptions& options, const FluxTruth& truth,
                                  const BeforeTurn& before_turn) {
    constexpr double kShareOfRays = 0.25, kReferenceRays = 6.0;  // enough for noise, and times a trace's
    FiveWaysOptions ways{.rays = kShareOfRays * options.rays,
                         .stickings = {options.sticking},
                         .target = options.flux_error,
                         .reference_rays = kReferenceRays * options.rays,
                         .long_run = &truth.flux,
                         .before_turn = before_turn};
    if (options.low_sticking < options.sticking) ways.stickings.push_back(options.low_sticking);
    return ways;
}

double turns_of_a_set(const StudyOptions& options) {
    double turns = 2.0;  // of the raw mesh
    for (const Method& method : kMethods) turns += method.traced ? 2.0 + std::max(1, options.repeats) : 1.0;
    return turns;
}

Surface grow(int number, const StudyOptions& options, Json& json) {
    const auto path = options.recipes / fmt::format("surface{}.toml", number);
    if (!std::filesystem::exists(path))
        throw FileError(
            fmt::format("{}: no such recipe; run from the repository's root or name the folder with "
                        "--recipes",
                        path.string()));
    std::vector<std::string> settings;
    if (options.grid_levels > 0) settings.push_back(fmt::format("grid.levels={}", options.grid_levels));
    const Recipe recipe = load_recipe(path, settings);
    const RunResult run = run_recipe(recipe, {.output = options.output / fmt::format("surface{}", number),
                                              .overwrite = options.overwrite,
                                              .quiet = options.quiet,
                                              .title = fmt::format("growing surface {}", number),
                                              .warn = options.quiet ? nullptr : print_warning});
    Surface surface{number, run.surface, run.summary["grid_spacing"].get<double>(), {}};
    surface.box = flux::lateral_box(surface.mesh, {flux::Boundary::reflective, flux::Boundary::reflective});
    const auto features = find_features(surface.mesh, surface.spacing, false),
               automatic = find_features(surface.mesh, surface.spacing, true);
    json = Json{{"surface", number},
                {"recipe", path.filename().string()},
                {"vertices", surface.mesh.vertices.size()},
                {"triangles", surface.mesh.triangles.size()},
                {"grid_spacing", surface.spacing},
                {"grid", run.summary["grid"]},
                {"length_unit", run.summary["length_unit"]},
                {"features", std::count(features.flags.begin(), features.flags.end(), 1)},
                {"features_auto",
                 {{"parameter", automatic.parameter},
                  {"count", std::count(automatic.flags.begin(), automatic.flags.end(), 1)}}}};
    return surface;
}

void save(const Json& study, const std::filesystem::path& folder) {
    write_json((folder / "study.json").string(), study);
    write_file(folder / "study.csv", study_csv(study));
    write_file(folder / "five_ways.csv", five_ways_csv(study));
}

}  // namespace

Json run_study(const StudyOptions& options) {
    Json study{{"version", version()},         {"threads", thread_count()},
               {"rays", options.rays},         {"method", options.radiosity ? "radiosity" : "monte-carlo"},
               {"sticking", options.sticking}, {"flux_error_target", options.flux_error},
               {"repeats", options.repeats},   {"surfaces", Json::array()}};
    for (const int number : options.surfaces) {
        study["surfaces"].emplace_back();
        Json& json = study["surfaces"].back();
        const Surface surface = grow(number, options, json);
        constexpr double kTurnsOfFiveWays = 100.0;  // about; radiosity takes as many as it needs
        const double turns =
            1.0 + static_cast<double>(options.removals.size()) * turns_of_a_set(options) + kTurnsOfFiveWays;
        ProgressBar progress(fmt::format("surface {}", number), turns, "turns", !options.quiet);
        progress.update(0.0, "reference flux");
        constexpr double kTruthRays = 4.0;
        const FluxTruth truth =
            make_truth(surface.mesh, surface.box, kTruthRays * options.rays, options.sticking);
        progress.update(0.0, "raw surface");
        json["raw"] = measure_raw(surface, truth, options);
        json["rows"] = Json::array();
        double done = 1.0;
        const auto end_if_interrupted = [&] {
            if (interrupted())
                throw Interrupted(fmt::format("stopped; what is finished is in {}",
                                              (options.output / "study.json").string()));
        };
        const auto before_turn = [&](const std::string& what) {
            end_if_interrupted();
            progress.update(std::min(turns, done++), what);
        };
        std::vector<SimplifiedMesh> kept;
        for (const double removal : options.removals) {
            Json rows = measure_set(surface, truth, removal, options, before_turn, kept);
            end_if_interrupted();  // whose last turn was cut short
            for (Json& row : rows) json["rows"].push_back(std::move(row));
            save(study, options.output);
        }
        json["five_ways"] =
            five_ways(surface.mesh, surface.box, kept, five_ways_options(options, truth, before_turn));
        end_if_interrupted();
        save(study, options.output);
    }
    for (const auto& [name, svg] : study_figures(study)) write_file(options.output / name, svg);
    write_file(options.output / "report.md", study_report(study));
    return study;
}

}  // namespace sidewall::app
