#include "app/evaluation/validate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/version.hpp"
#include "app/process/record/run_folder.hpp"
#include "app/process/simulation.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/results/result.hpp"
#include "app/results/whole_summary.hpp"
#include "app/schema/keys.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"

namespace sidewall::app {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kUp = 0.9, kLevel = 0.1;  // of a normal's z: what faces up, what faces sideways
constexpr int kDigits = 6;
constexpr const char* kReport = "validation.json";
// Of a grid spacing: flats are known to lie within it (tests/integration/profile_test.cpp), so no length is
// claimed to be better known.
constexpr double kResolution = 0.1;

// The figures of a run, in the order of the readings; NaN where one does not exist.
using Figures = std::vector<double>;

bool counts(const ValidationReading& reading, const Vec3& centroid, double up, double material) {
    if (centroid.z() < reading.z_low || centroid.z() > reading.z_high) return false;
    if (std::hypot(centroid.x(), centroid.y()) > reading.radius) return false;
    switch (reading.kind) {
        case ValidationReading::Kind::floor:
            return up >= kUp;
        case ValidationReading::Kind::wall:
            return std::abs(up) <= kLevel;
        case ValidationReading::Kind::share:
            return material == 0.0;
        default:
            return true;
    }
}

// Mean over the area of the triangles that count, or their sum by the opening's area.
double flux_figure(const TriangleMesh& mesh, const ValidationReading& reading) {
    const Attribute *flux = mesh.triangle_attribute(reading.name),
                    *material = mesh.triangle_attribute("material");
    if (flux == nullptr || material == nullptr) return kNone;
    double sum = 0.0, area = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 twice = area_vector(mesh, t);
        const double a = 0.5 * twice.norm();
        if (!(a > 0.0) ||
            !counts(reading, triangle_centroid(mesh, t), 0.5 * twice.z() / a, material->values[t]))
            continue;
        sum += a * flux->values[t];
        area += a;
    }
    if (reading.kind == ValidationReading::Kind::share) area = reading.opening;
    return area > 0.0 ? sum / area : kNone;
}

// Whether a run of the recipe by this version is there, or a part of one.
bool has_begun(const std::filesystem::path& folder, const Recipe& recipe) {
    if (!holds_recipe(folder, effective_recipe(recipe))) return false;
    if (!is_there(folder / "summary.json")) return true;
    const Json summary = read_summary(folder);
    if (has_other_version(summary)) return false;
    require_whole(summary, folder);
    return true;
}

Figures run_case(const ValidationCase& one, const std::filesystem::path& folder,
                 const std::vector<std::string>& changes, const ValidationOptions& options, double& seconds) {
    const Recipe recipe = parse_recipe(one.recipe, one.name + ".toml", changes);
    const bool resume = options.resume && has_begun(folder, recipe);
    const RunResult run = run_recipe(recipe, {.output = folder,
                                              .resume = resume,
                                              .overwrite = options.overwrite && !resume,
                                              .quiet = true,
                                              .title = one.name,
                                              .resume_command = options.resume_command,
                                              .warn = print_warning});
    seconds += run.summary["timing"]["total"].get<double>();  // as rounded as that of a run that was there
    const TriangleMesh start = surface::read_mesh(folder / "surface_0000.vtp");
    Figures figures;
    for (const ValidationReading& reading : one.readings) {
        if (reading.kind != ValidationReading::Kind::measure) {
            figures.push_back(flux_figure(start, reading));
            continue;
        }
        const Json& value = run.summary["metrology"][reading.name];
        figures.push_back(value.is_number() ? value.get<double>() : kNone);
    }
    return figures;
}

Json validate_case(const ValidationCase& one, const ValidationOptions& options) {
    double seconds = 0.0;
    const auto run = [&](const char* suffix, const std::vector<std::string>& changes) {
        return run_case(one, options.output / (one.name + suffix), changes, options, seconds);
    };
    const double spacing = parse_recipe(one.recipe, one.name + ".toml").domain.grid_spacing;
    const Figures ours = run("", {}),
                  coarse = run("-coarse", {fmt::format("domain.grid_spacing={}", 2.0 * spacing)});
    const Figures other = one.traced ? run("-seed", {"flux.seed=2"}) : ours;
    Json json{{"name", one.name},   {"title", one.title},      {"source", one.source},
              {"note", one.note},   {"grid_spacing", spacing}, {"recipe", one.recipe},
              {"seconds", nullptr}, {"version", version()},    {"readings", Json::array()}};
    for (std::size_t k = 0; k < one.readings.size(); ++k) {
        const ValidationReading& reading = one.readings[k];
        const double least = reading.length ? kResolution * spacing : 0.0;
        const double noise = std::abs(other[k] - ours[k]),
                     grid = std::max(least, std::abs(coarse[k] - ours[k]));
        const double deviation = ours[k] - reading.reference, bars = noise + grid + reading.reference_bar;
        json["readings"].push_back(
            Json{{"label", reading.label},
                 {"unit", reading.unit},
                 {"ours", number_or_null(ours[k], kDigits)},
                 {"noise", number_or_null(noise, 2)},
                 {"grid", number_or_null(grid, 2)},
                 {"reference", number_or_null(reading.reference, 8)},
                 {"reference_bar", number_or_null(reading.reference_bar, 2)},
                 {"deviation", number_or_null(deviation, 3)},
                 {"deviation_percent", number_or_null(100.0 * deviation / reading.reference, 3)},
                 {"within_bars", std::abs(deviation) <= bars}});
    }
    json["seconds"] = number_or_null(seconds, 3);
    return json;
}

std::vector<const ValidationCase*> chosen(const std::vector<std::string>& names) {
    std::vector<const ValidationCase*> list;
    std::vector<std::string> known;
    for (const ValidationCase& one : validation_cases()) {
        known.push_back(one.name);
        if (names.empty()) list.push_back(&one);
    }
    for (const std::string& name : names) {
        const auto found = std::find(known.begin(), known.end(), name);
        if (found == known.end())
            throw RecipeError(
                fmt::format("--case {}: there is no such case{}", name,
                            did_you_mean(": ", name, known, ": `sidewall validate --list` lists all")));
        list.push_back(&validation_cases()[static_cast<std::size_t>(found - known.begin())]);
    }
    return list;
}

// Whether it is what validate_case makes: a report may be damaged.
bool is_reading(const Json& reading) {
    if (!reading.is_object()) return false;
    for (const char* key : {"ours", "noise", "grid", "reference", "reference_bar", "deviation_percent"})
        if (!reading.contains(key)) return false;
    return reading["reference_bar"].is_number() && reading.value("label", Json()).is_string() &&
           reading.value("unit", Json()).is_string() && reading.value("within_bars", Json()).is_boolean();
}

// The rows of the report that is there, by case, of those that are still the same.
std::map<std::string, Json> earlier_rows(const std::filesystem::path& folder) {
    std::map<std::string, Json> rows;
    if (!is_there(folder / kReport)) return rows;
    const Json report = read_json(folder / kReport, "remove it, or choose another folder with -o");
    if (!report.is_object() || !report.value("cases", Json()).is_array()) return rows;
    for (const Json& row : report["cases"])
        for (const ValidationCase& one : validation_cases())
            if (row.is_object() && row.value("name", Json()) == one.name &&
                row.value("recipe", Json()) == one.recipe && row.value("title", Json()).is_string() &&
                row.value("source", Json()).is_string() && row.value("note", Json()).is_string() &&
                row.contains("grid_spacing") && row.contains("seconds") &&
                row.value("readings", Json()).is_array() && row["readings"].size() == one.readings.size() &&
                std::all_of(row["readings"].begin(), row["readings"].end(), is_reading))
                rows[one.name] = row;
    return rows;
}

// Significant digits for a table.
std::string text(const Json& number, int digits = 5) {
    return number.is_number() ? fmt::format("{:.{}g}", number.get<double>(), digits) : "none";
}

std::string row(const Json& reading) {
    const std::string unit = reading["unit"] == "1" ? "" : ", in " + reading["unit"].get<std::string>();
    const double bar = reading["reference_bar"].get<double>();
    return fmt::format(
        "| {}{} | {} | {} | {} | {}{} | {} % | {} |\n", reading["label"].get<std::string>(), unit,
        text(reading["ours"]), text(reading["noise"], 2), text(reading["grid"], 2),
        text(reading["reference"], 6), bar > 0.0 ? " +- " + text(reading["reference_bar"], 2) : "",
        text(reading["deviation_percent"], 2), reading["within_bars"].get<bool>() ? "yes" : "no");
}

}  // namespace

std::string validation_page(const Json& validation) {
    std::string page =
        "# Validation\n\n"
        "Figures that are known from closed forms, published tables or another simulator, and what Sidewall computes. Made by\n"
        "`sidewall validate`, which runs every case again and writes this page (`results/validation/validation.md`), with the\n"
        "recipes in `validation.json`.\n\n"
        "- \"ours\": from a run with the case's grid spacing and seed 1.\n"
        "- \"noise\": difference to the same run with another seed; 0 where nothing is traced.\n"
        "- \"grid\": difference to the same run on twice the spacing. For a scheme of first order that is the size of the error\n"
        "  that the grid leaves. Of lengths at least a tenth of the grid spacing, within which flat faces are known to lie.\n"
        "- \"within\": whether ours and the reference differ by no more than noise, grid and the reference's own bar together.\n"
        "  A \"no\" is a finding: the bars are estimates from two runs each, not bounds.\n";
    std::size_t figures = 0, within = 0;
    for (const Json& one : validation["cases"])
        for (const Json& reading : one["readings"]) {
            ++figures;
            within += reading["within_bars"].get<bool>() ? 1 : 0;
        }
    page += fmt::format("\nOf {} figures {} lie within.\n", figures, within);
    for (const Json& one : validation["cases"]) {
        std::string title = one["title"].get<std::string>();
        title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
        page += fmt::format("\n## {}\n\n{}.\n\n", one["name"].get<std::string>(), title);
        page +=
            "| figure | ours | noise | grid | reference | deviation | within |\n|---|---|---|---|---|---|---|\n";
        for (const Json& reading : one["readings"]) page += row(reading);
        page += fmt::format("\nReference: {}. Grid spacing {}.", one["source"].get<std::string>(),
                            text(one["grid_spacing"]));
        const auto note = one["note"].get<std::string>();
        page += note.empty() ? "\n" : " " + note + "\n";
    }
    page +=
        "\n## What is left out\n\n"
        "- Bosch process (Ertl and Selberherr 2010): `configs/bosch_hole.toml` has their parameters, but no figures of their\n"
        "  profiles are at hand to compare with.\n"
        "- Atomic layer deposition in lateral cavities (Ylilammi et al. 2018; Arts et al. 2019): published models take diffusion\n"
        "  through a gas; `ald` is ballistic, and ballistic models reach deeper (Jarvilehto et al. 2023). A difference would\n"
        "  tell nothing of either.\n"
        "- TEOS: no table with all its parameters is at hand.\n";
    return page;
}

Json validate(const ValidationOptions& options) {
    const std::vector<const ValidationCase*> cases = chosen(options.cases);
    std::map<std::string, Json> rows = earlier_rows(options.output);
    Json validation;
    for (const ValidationCase* one : cases) {
        const Json& row = rows[one->name] = validate_case(*one, options);
        if (options.finished) options.finished(row);
        validation = Json{{"version", version()}, {"cases", Json::array()}};
        for (const ValidationCase& any : validation_cases())
            if (rows.contains(any.name)) validation["cases"].push_back(rows[any.name]);
        // What is finished is kept, should a later case be interrupted.
        write_json((options.output / kReport).string(), validation);
        write_file(options.output / "validation.md", validation_page(validation));
    }
    return validation;
}

}  // namespace sidewall::app
