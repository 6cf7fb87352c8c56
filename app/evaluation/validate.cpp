#include "app/evaluation/validate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "app/accuracy/accuracy.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/version.hpp"
#include "app/evaluation/validate_cases.hpp"
#include "app/fit/fit_profile.hpp"
#include "app/process/record/run_folder.hpp"
#include "app/process/simulation.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/results/result.hpp"
#include "app/schema/keys.hpp"
#include "surface/files/file.hpp"
#include "surface/files/mesh_io.hpp"

namespace sidewall::app {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kUp = 0.9, kLevel = 0.1;  // of a normal's z: what faces up, what faces sideways
constexpr int kDigits = 6;
constexpr const char* kReport = "validation.json";
// Flats are known to lie within this part of a grid spacing (tests/integration/profile_test.cpp); no length
// is claimed to be better known.
constexpr double kResolution = 0.1;

// Mean over the area of the triangles that count, or their sum by the opening's area.
double flux_figure(const TriangleMesh& mesh, const ReferenceFigure& figure, const Recipe& recipe) {
    const Attribute *flux = mesh.triangle_attribute(figure.figure),
                    *material = mesh.triangle_attribute("material");
    if (flux == nullptr || material == nullptr) return kNone;
    const auto wanted = material_id(recipe.materials, figure.where);
    double sum = 0.0, area = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 twice = area_vector(mesh, t), centroid = triangle_centroid(mesh, t);
        const double a = 0.5 * twice.norm(), up = 0.5 * twice.z() / a;
        const bool counts = a > 0.0 && centroid.z() >= figure.z_from && centroid.z() <= figure.z_to &&
                            std::hypot(centroid.x(), centroid.y()) <= figure.radius &&
                            (figure.where != "floor" || up >= kUp) &&
                            (figure.where != "wall" || std::abs(up) <= kLevel) &&
                            (!wanted || material->values[t] == *wanted);
        if (!counts) continue;
        sum += a * flux->values[t];
        area += a;
    }
    if (figure.opening > 0.0) area = figure.opening;
    return area > 0.0 ? sum / area : kNone;
}

// Mean distance of a measured profile's points from that of a run.
double profile_figure(const std::string& file, const Recipe& recipe, const fs::path& run) {
    const MeasuredProfile profile = read_measured_profile(file, recipe.domain.length_unit);
    const auto distance = distance_to(contour_of(run, recipe, profile.time), profile.points, {});
    return distance ? distance->signed_distances.cwiseAbs().mean() : kNone;
}

// Whether a run of the recipe by this version is there, or a part of one.
bool has_begun(const fs::path& folder, const Recipe& recipe) {
    if (!holds_recipe(folder, effective_recipe(recipe))) return false;
    if (!is_there(folder / "summary.json")) return true;
    const Json summary = read_summary(folder);
    if (has_other_version(summary)) return false;
    require_whole(summary, folder);
    return true;
}

// The figures of a run, in the order of the table; NaN where one does not exist.
std::vector<double> run_case(const ValidationCase& one, const char* suffix,
                             const std::vector<std::string>& changes, const ValidationOptions& options,
                             double& seconds) {
    const fs::path folder = options.output / (one.name + suffix);
    const Recipe recipe = case_recipe(one, changes);
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
    std::vector<double> figures;
    for (const ReferenceFigure& figure : one.figures)
        figures.push_back(figure.is_flux() ? flux_figure(start, figure, recipe)
                          : figure.is_profile()
                              ? profile_figure((one.folder / figure.figure).string(), recipe, folder)
                              : figure_of(run.summary, figure.figure));
    return figures;
}

Json validate_case(const ValidationCase& one, const ValidationOptions& options) {
    double seconds = 0.0;
    const auto run = [&](const char* suffix, const std::vector<std::string>& changes) {
        return run_case(one, suffix, changes, options, seconds);
    };
    const Recipe recipe = case_recipe(one);
    const double spacing = recipe.domain.grid_spacing;
    const std::vector<double> ours = run("", {}),
                              coarse = run("-coarse", {fmt::format("domain.grid_spacing={}", 2.0 * spacing)}),
                              other = traces(recipe) ? run("-seed", {"flux.seed=2"}) : ours;
    Json json{{"name", one.name},        {"title", one.title},
              {"source", one.source},    {"note", one.note},
              {"grid_spacing", spacing}, {"recipe", one.recipe},
              {"table", one.table},      {"seconds", number_or_null(seconds, 3)},
              {"version", version()},    {"readings", Json::array()}};
    for (std::size_t k = 0; k < one.figures.size(); ++k) {
        const ReferenceFigure& figure = one.figures[k];
        const double least = figure.unit == recipe.domain.length_unit ? kResolution * spacing : 0.0;
        const double noise = std::abs(other[k] - ours[k]),
                     grid = std::max(least, std::abs(coarse[k] - ours[k]));
        const double deviation = ours[k] - figure.reference, bars = noise + grid + figure.bar;
        json["readings"].push_back(
            Json{{"label", figure.label},
                 {"unit", figure.unit},
                 {"ours", number_or_null(ours[k], kDigits)},
                 {"noise", number_or_null(noise, 2)},
                 {"grid", number_or_null(grid, 2)},
                 {"reference", number_or_null(figure.reference, 8)},
                 {"reference_bar", number_or_null(figure.bar, 2)},
                 {"deviation", number_or_null(deviation, 3)},
                 {"deviation_percent", number_or_null(100.0 * deviation / figure.reference, 3)},
                 {"within_bars", std::abs(deviation) <= bars}});
    }
    return json;
}

std::vector<ValidationCase> chosen(const std::vector<ValidationCase>& all,
                                   const std::vector<std::string>& names) {
    std::vector<ValidationCase> list;
    std::vector<std::string> known;
    known.reserve(all.size());
    for (const ValidationCase& one : all) known.push_back(one.name);
    for (const std::string& name : names) {
        const auto found = std::find(known.begin(), known.end(), name);
        if (found == known.end())
            throw RecipeError("--case {}: there is no such case{}", name,
                              did_you_mean(": ", name, known, ": `sidewall validate --list` lists all"));
        list.push_back(all[static_cast<std::size_t>(found - known.begin())]);
    }
    return names.empty() ? all : list;
}

// The part of the page about a case. Throws Json::exception if the row is damaged.
std::string section_of(const Json& row) {
    std::string title = row.at("title").get<std::string>();
    title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
    std::string page = fmt::format(
        "\n## {}\n\n{}.\n\n"
        "| figure | ours | noise | grid | reference | deviation | within |\n|---|---|---|---|---|---|---|\n",
        row.at("name"), title);
    for (const Json& reading : row.at("readings")) {
        const auto unit = reading.at("unit").get<std::string>();
        const double bar = reading.at("reference_bar").get<double>();
        page += fmt::format("| {}{} | {:.5g} | {:.2g} | {:.2g} | {:.6g}{} | {:.2g} % | {} |\n",
                            reading.at("label"), unit == "1" ? "" : ", in " + unit, reading.at("ours"),
                            reading.at("noise"), reading.at("grid"), reading.at("reference"),
                            bar > 0.0 ? fmt::format(" +- {:.2g}", bar) : "", reading.at("deviation_percent"),
                            reading.at("within_bars").get<bool>() ? "yes" : "no");
    }
    const auto note = row.at("note").get<std::string>();
    return page + fmt::format("\nReference: {}. Grid spacing {:.5g}.{}\n", row.at("source"),
                              row.at("grid_spacing"), note.empty() ? "" : " " + note);
}

// The rows of the report that is there, by case, of those whose files are still the same.
std::map<std::string, Json> earlier_rows(const fs::path& folder, const std::vector<ValidationCase>& cases) {
    std::map<std::string, Json> rows;
    if (!is_there(folder / kReport)) return rows;
    const Json report = read_json(folder / kReport, "remove it, or choose another folder with -o");
    for (const Json& row : report.is_object() ? report.value("cases", Json()) : Json()) {
        try {
            section_of(row);
            for (const ValidationCase& one : cases)
                if (row.at("name") == one.name && row.at("recipe") == one.recipe &&
                    row.at("table") == one.table)
                    rows[one.name] = row;
        } catch (const Json::exception&) {
            continue;  // the report is damaged: this case is without figures
        }
    }
    return rows;
}

// The page in Markdown: \p frame with all cases in place of its line CASES.
std::string validation_page(const Json& validation, const std::string& frame) {
    std::string sections;
    std::size_t figures = 0, within = 0;
    for (const Json& row : validation["cases"]) {
        sections += section_of(row);
        for (const Json& reading : row["readings"]) within += reading["within_bars"].get<bool>() ? 1 : 0;
        figures += row["readings"].size();
    }
    const std::string mark = "CASES\n";
    const std::size_t at = std::min(frame.find(mark), frame.size());
    return fmt::format("{}Of {} figures {} lie within.\n{}{}", frame.substr(0, at), figures, within, sections,
                       frame.substr(std::min(at + mark.size(), frame.size())));
}

}  // namespace

Json validate(const ValidationOptions& options) {
    const std::vector<ValidationCase> all = validation_cases(options.folder),
                                      cases = chosen(all, options.cases);
    for (const ValidationCase& one : cases) case_recipe(one);  // all mistakes before the first run
    const fs::path page = options.folder / "page.md";
    const std::string frame = is_there(page) ? surface::read_whole_file(page) : "# Validation\n\n";
    std::map<std::string, Json> rows = earlier_rows(options.output, all);
    Json validation;
    for (const ValidationCase& one : cases) {
        const Json& row = rows[one.name] = validate_case(one, options);
        if (options.finished) options.finished(row);
        validation = Json{{"version", version()}, {"cases", Json::array()}};
        for (const ValidationCase& any : all)
            if (rows.contains(any.name)) validation["cases"].push_back(rows[any.name]);
        // What is finished is kept, should a later case be interrupted.
        write_json((options.output / kReport).string(), validation);
        write_file(options.output / "validation.md", validation_page(validation, frame));
    }
    return validation;
}

}  // namespace sidewall::app
