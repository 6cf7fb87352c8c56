#include "app/evaluation/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>

#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/processes.hpp"
#include "app/common/timing.hpp"
#include "app/common/version.hpp"
#include "app/process/simulation.hpp"
#include "flux/tracer/tracer.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"
#include "surface/files/mesh_io.hpp"

namespace sidewall::app {
namespace {

struct Method {
    const char* name;
    simplify::Method method;
    simplify::Weights weights;
};

const Method kMethods[] = {
    {"raw", simplify::Method::none, simplify::kVolumeWeights},
    {"lindstrom-turk 0.5/0.5/0", simplify::Method::lindstrom_turk, simplify::kVolumeWeights},
    {"lindstrom-turk 0.4/0.3/0.3", simplify::Method::lindstrom_turk, simplify::kShapeWeights},
    {"region", simplify::Method::region, simplify::kVolumeWeights},
    {"region-bounded", simplify::Method::region_bounded, simplify::kVolumeWeights},
};

struct Surface {
    int number;
    TriangleMesh mesh;
    double spacing;
    flux::LateralBox box;
};

using BeforeTurn = std::function<void(const std::string&)>;

// The mesh that a method makes with a share `removal` of the vertices removed. Seconds are CPU seconds.
TriangleMesh simplified(const Surface& surface, const Method& method, double removal, Json& seconds) {
    const bool regions = simplify::reads_features(method.method);
    simplify::Options options;
    options.method = method.method;
    options.weights = method.weights;
    options.grid_spacing = surface.spacing;
    options.target_vertices = static_cast<std::size_t>(
        std::lround((1.0 - removal) * static_cast<double>(surface.mesh.vertices.size())));
    // Features stay untouched up to a removal of half the vertices; beyond, they are coarsened, too.
    if (regions && removal > 0.5) options.l0 = surface.spacing;
    const double start = cpu_seconds();
    std::vector<std::uint8_t> flags;
    if (regions) flags = surface::feature_flags(surface.mesh, surface.spacing);
    const double found = cpu_seconds();
    TriangleMesh mesh = simplify::simplify(surface.mesh, flags, options).mesh;
    const double end = cpu_seconds();
    seconds = {{"features", found - start}, {"collapse", end - found}, {"simplification", end - start}};
    return mesh;
}

Json distance_json(const surface::Distance& distance, double spacing) {
    return Json{{"max", distance.max / spacing}, {"mean", distance.mean / spacing}};
}

// Pairs of a distance, in grid spacings, and the share of the vertices with a larger one.
Json exceedance(const surface::Distance& distance, double spacing) {
    std::vector<double> sorted = distance.per_vertex;
    std::ranges::sort(sorted);
    Json json = Json::array();
    for (double share = 0.95; share > 1e-4; share *= 0.75) {
        const double rank = (1.0 - share) * static_cast<double>(sorted.size());
        json.push_back({sorted[static_cast<std::size_t>(rank)] / spacing, share});
    }
    return json;
}

// The simplified mesh with its distance to the original by vertex, as in Figures 8.8 to 8.11.
void write_coloured(const StudyOptions& options, const Surface& surface, TriangleMesh mesh,
                    std::string method, const surface::Distance& distance) {
    std::ranges::replace_if(
        method, [](char c) { return c == ' ' || c == '/'; }, '-');
    mesh.vertex_attributes = {{"distance", 1, Scalar::float32, distance.per_vertex}};
    surface::write_mesh(options.output / fmt::format("surface{}_{}_simplified.vtp", surface.number, method),
                        mesh,
                        {.texts = {{"length_unit", "um"}}, .numbers = {{"grid_spacing", surface.spacing}}});
}

// A mesh to trace, with the CPU seconds of building its ray tracing hierarchy and of its traces so far.
struct TracedMesh {
    explicit TracedMesh(TriangleMesh simplified)
        : mesh(std::move(simplified)),
          start(cpu_seconds()),
          scene(mesh),
          bvh_seconds(cpu_seconds() - start) {}

    TriangleMesh mesh;
    double start;
    surface::RayScene scene;
    double bvh_seconds, trace_seconds = 0.0;
    flux::Wedges wedges = flux::make_wedges(mesh);
};

// Measures all methods at one removal. Traces take turns, so that other work on the machine slows each.
Json measure_set(const Surface& surface, double removal, const StudyOptions& options,
                 const BeforeTurn& before_turn) {
    Json rows = Json::array();
    std::deque<TracedMesh> meshes;  // a deque, as hierarchies point into them
    for (const Method& method : kMethods) {
        before_turn(fmt::format("{:.0f} % {}", 100.0 * removal, method.name));
        Json seconds;
        const TriangleMesh& mesh = meshes.emplace_back(simplified(surface, method, removal, seconds)).mesh;
        const auto distance = surface::two_sided_distance(surface.mesh, mesh);
        rows.push_back({{"method", method.name},
                        {"removal", removal},
                        {"vertices", mesh.vertices.size()},
                        {"triangles", mesh.triangles.size()},
                        {"seconds", std::move(seconds)},
                        {"original_to_simplified", distance_json(distance.forward, surface.spacing)},
                        {"simplified_to_original", distance_json(distance.backward, surface.spacing)},
                        {"exceedance", exceedance(distance.forward, surface.spacing)}});
        if (removal == options.removals.back())
            write_coloured(options, surface, mesh, method.name, distance.backward);
    }
    for (std::uint64_t seed = 1; seed <= 2; ++seed)
        for (std::size_t k = 0; k < meshes.size(); ++k) {
            TracedMesh& traced = meshes[k];
            before_turn(fmt::format("{:.0f} % {}, tracing", 100.0 * removal, kMethods[k].name));
            const double start = cpu_seconds();
            flux::trace_flux(
                traced.mesh, traced.scene, surface.box, {.sticking = {options.sticking}}, {}, traced.wedges,
                {.rays = static_cast<std::uint64_t>(0.5 * options.rays), .seed = seed, .stop = interrupted});
            traced.trace_seconds += cpu_seconds() - start;
        }
    before_turn("");  // throws if an interruption cut the last trace short
    for (std::size_t k = 0; k < meshes.size(); ++k)
        rows[k]["trace"] = {
            {"rays", options.rays},
            {"seconds", {{"bvh", meshes[k].bvh_seconds}, {"trace", meshes[k].trace_seconds}}}};
    return rows;
}

Surface grow(int number, const StudyOptions& options, Json& json) {
    const auto path = options.recipes / fmt::format("surface{}.toml", number);
    if (!fs::exists(path))
        throw FileError(
            "{}: no such recipe; run from the repository's root or name the folder with "
            "--recipes",
            path.string());
    std::vector<std::string> settings;
    if (options.grid_levels > 0) settings.push_back(fmt::format("grid.levels={}", options.grid_levels));
    const RunResult run =
        run_recipe(load_recipe(path, settings), {.output = options.output / fmt::format("surface{}", number),
                                                 .overwrite = options.overwrite,
                                                 .quiet = options.quiet,
                                                 .title = fmt::format("growing surface {}", number),
                                                 .warn = options.quiet ? nullptr : print_warning});
    Surface surface{number, run.surface, run.summary["grid_spacing"].get<double>(), {}};
    surface.box = flux::lateral_box(surface.mesh, {flux::Boundary::reflective, flux::Boundary::reflective});
    json = Json{{"surface", number},
                {"recipe", path.filename().string()},
                {"vertices", surface.mesh.vertices.size()},
                {"triangles", surface.mesh.triangles.size()},
                {"grid_spacing", surface.spacing},
                {"grid", run.summary["grid"]},
                {"length_unit", run.summary["length_unit"]},
                {"rows", Json::array()}};
    return surface;
}

constexpr const char* kMean = "/original_to_simplified/mean";
constexpr const char* kTrace = "/trace/seconds/trace";

std::string study_csv(const Json& study) {
    constexpr std::pair<const char*, const char*> kColumns[]{
        {"vertices", "/vertices"},
        {"triangles", "/triangles"},
        {"max_distance_dx", "/original_to_simplified/max"},
        {"mean_distance_dx", kMean},
        {"back_max_distance_dx", "/simplified_to_original/max"},
        {"back_mean_distance_dx", "/simplified_to_original/mean"},
        {"features_s", "/seconds/features"},
        {"collapse_s", "/seconds/collapse"},
        {"bvh_s", "/trace/seconds/bvh"},
        {"trace_s", kTrace}};
    std::string text = "surface,method,removal";
    for (const auto& column : kColumns) text += fmt::format(",{}", column.first);
    for (const Json& surface : study["surfaces"])
        for (const Json& row : surface["rows"]) {
            text += fmt::format("\n{},{},{}", surface["surface"], row["method"], row["removal"]);
            for (const auto& [name, pointer] : kColumns) {
                const Json value = row.value(Json::json_pointer(pointer), Json());
                text += value.is_null() ? "," : fmt::format(",{:.9g}", value.get<double>());
            }
        }
    return text + "\n";
}

void save(const Json& study, const fs::path& folder) {
    write_json((folder / "study.json").string(), study);
    write_file(folder / "study.csv", study_csv(study));
}

void study_surface(int number, const StudyOptions& options, Json& study) {
    Json& json = study["surfaces"].emplace_back();
    const Surface surface = grow(number, options, json);
    ProgressBar progress(fmt::format("surface {}", number), static_cast<double>(options.removals.size()),
                         "sets", !options.quiet);
    double done = 0.0;
    const BeforeTurn before_turn = [&](const std::string& what) {
        if (interrupted())
            throw Interrupted("stopped; what is finished is in " + (options.output / "study.json").string());
        progress.update(done, what);
    };
    for (const double removal : options.removals) {
        for (Json& row : measure_set(surface, removal, options, before_turn))
            json["rows"].push_back(std::move(row));
        save(study, options.output);
        ++done;
    }
}

// Mean of the values at a JSON pointer in a method's rows, over all shares of vertices removed.
double mean(const Json& surface, const std::string& method, const char* pointer) {
    double sum = 0.0, count = 0.0;
    for (const Json& row : surface["rows"])
        if (row["method"] == method) sum += row.at(Json::json_pointer(pointer)).get<double>(), ++count;
    return sum / count;
}

std::string line(const std::vector<std::string>& cells) {
    return fmt::format("| {} |\n", fmt::join(cells, " | "));
}

std::string head(const std::vector<std::string>& cells) {
    return line(cells) + line(std::vector<std::string>(cells.size(), "---"));
}

// A claim of the chapter on a quantity relative to another method's, with the largest change confirming it.
struct Claim {
    const char *quantity, *chapter, *pointer, *base;
    double at_most;
};

constexpr const char* kPlainName = "lindstrom-turk 0.5/0.5/0";
constexpr const char* kShapeName = "lindstrom-turk 0.4/0.3/0.3";
const Claim kClaims[] = {
    {"mean distance to the original", "-20 to -40 %", kMean, kShapeName, -0.2},
    {"mean distance to the original", "-20 to -40 %", kMean, kPlainName, -0.2},
    {"simplification time, features included", "+17 %", "/seconds/simplification", kPlainName, 0.17},
    {"tracing time", "-15 %, more in deep trenches", kTrace, "raw", -0.15},
    {"tracing time", "up to -12 % (deep)", kTrace, kShapeName, -0.05},  // smaller changes are noise
};

std::string verdicts(const Json& study) {
    std::vector<std::string> names{"claim", "chapter"};
    for (const Json& surface : study["surfaces"])
        names.push_back(fmt::format("surface {}", surface["surface"]));
    names.emplace_back("verdict");
    std::string text = head(names);
    for (const Claim& claim : kClaims)
        for (const char* region : {"region", "region-bounded"}) {
            std::vector<std::string> cells{
                fmt::format("{}, {} against {}", claim.quantity, region, claim.base), claim.chapter};
            bool holds = true;
            for (const Json& surface : study["surfaces"]) {
                const double change =
                    mean(surface, region, claim.pointer) / mean(surface, claim.base, claim.pointer) - 1.0;
                cells.push_back(std::isfinite(change) ? fmt::format("{:+.0f} %", 100.0 * change) : "-");
                holds = holds && change <= claim.at_most;
            }
            cells.emplace_back(holds ? "holds" : "does not hold");
            text += line(cells);
        }
    return text +
           "\nMeans over all sets of vertices removed; negative is less. A claim holds if it does on every "
           "surface.\n\n";
}

}  // namespace

Json run_study(const StudyOptions& options) {
    Json study{{"version", version()},
               {"threads", thread_count()},
               {"rays", options.rays},
               {"sticking", options.sticking},
               {"surfaces", Json::array()}};
    for (const int number : options.surfaces) study_surface(number, options, study);
    write_file(options.output / "report.md", study_report(study));
    return study;
}

std::string study_report(const Json& study) {
    const bool hierarchical = std::ranges::any_of(
        study["surfaces"], [](const Json& surface) { return surface["grid"]["levels"].size() > 1; });
    return fmt::format(
               "# Region simplification on process surfaces\n\nThe evaluation of Lenz (2023), section 8.3, "
               "repeated on surfaces that Sidewall grew. They come from {}, and they carry the roughness of their own "
               "Monte Carlo fluxes. Methods at equal numbers of vertices; CPU seconds of all threads.\n\n",
               hierarchical ? "a grid of several levels, as the chapter's do"
                            : "a uniform grid where the chapter's come from a hierarchical one") +
           "## Verdicts\n\n" + verdicts(study);
}

}  // namespace sidewall::app
