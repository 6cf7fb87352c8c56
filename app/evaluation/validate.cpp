#include "app/evaluation/validate.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "app/accuracy/accuracy.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/common/version.hpp"
#include "app/evaluation/validate_cases.hpp"
#include "app/evaluation/validate_chart.hpp"
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
constexpr double kUp = 0.9, kLevel = 0.1;  // least z of a floor's unit normal, largest |z| of a wall's
constexpr int kDigits = 6;
constexpr const char* kReport = "validation.json";
constexpr const char* kSame = "same number";  // the role of a value that the recipe was given
// Flats lie within this part of a grid spacing of the right place (tests/integration/profile_test.cpp); no
// length is claimed to be more accurate.
constexpr double kResolution = 0.1;

// Mean over the area of the triangles that count, or their sum over the opening's area. In a round wafer area
// is weighted with r.
double surface_figure(const TriangleMesh& mesh, const ReferenceFigure& figure, const Recipe& recipe) {
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
        const double weight = recipe.domain.symmetry == Symmetry::axial ? a * centroid.x() : a;
        sum += weight * flux->values[t];
        area += weight;
    }
    if (figure.opening > 0.0) area = figure.opening;
    return area > 0.0 ? sum / area : kNone;
}

// Mean unsigned distance of a measured profile's points from the profile of a run.
double profile_figure(const std::string& file, const Recipe& recipe, const fs::path& run) {
    const MeasuredProfile profile = read_measured_profile(file, recipe.domain.length_unit);
    const auto distance = distance_to(contour_of(run, recipe, profile.time), profile.points, {});
    return distance ? distance->signed_distances.cwiseAbs().mean() : kNone;
}

// Whether the folder holds a run of the recipe by this version, or a part of one.
bool has_begun(const fs::path& folder, const Recipe& recipe) {
    if (!holds_recipe(folder, effective_recipe(recipe))) return false;
    if (!is_there(folder / "summary.json")) return true;
    const Json summary = read_summary(folder);
    if (has_other_version(summary)) return false;
    require_whole(summary, folder);
    return true;
}

// A run of a case: the rows that use it, and its changes of their recipe.
struct CaseRun {
    std::vector<std::size_t> rows;
    std::string suffix;  // ends the name of its folder
    std::vector<std::string> changes;
};

// Makes a run and returns the figures of its rows; NaN where one does not exist.
std::vector<double> figures_of(const ValidationCase& one, const CaseRun& made,
                               const ValidationOptions& options, double& seconds) {
    const fs::path folder = options.output / (one.name + made.suffix);
    const Recipe recipe = case_recipe(one, made.rows, made.changes);
    const bool resume = options.resume && has_begun(folder, recipe);
    const RunResult run = run_recipe(recipe, {.output = folder,
                                              .resume = resume,
                                              .overwrite = options.overwrite && !resume,
                                              .quiet = true,
                                              .title = one.name,
                                              .resume_command = options.resume_command,
                                              .warn = print_warning});
    seconds += run.summary["timing"]["total"].get<double>();  // rounded, as that of an earlier run is
    // The traced mesh has the fluxes as they were tallied, but no coverages.
    const auto start = [&](const ReferenceFigure& figure) {
        const fs::path traced = folder / "traced_0000.vtp";
        const bool has = is_there(traced) && !figure.figure.starts_with("coverage_");
        return surface::read_mesh(has ? traced : folder / "surface_0000.vtp");
    };
    std::vector<double> figures;
    for (const std::size_t row : made.rows) {
        const ReferenceFigure& figure = one.figures[row];
        figures.push_back((figure.is_of_surface() ? surface_figure(start(figure), figure, recipe)
                           : figure.is_profile()
                               ? profile_figure((one.folder / figure.figure).string(), recipe, folder)
                               : figure_of(run.summary, figure.figure)) /
                          figure.per);
    }
    return figures;
}

// A row of the report, from the results on the case's grid, on twice the spacing and with another seed.
// \param least  smallest error bar of the grid. It counts for within_bars where the bar is unknown (NaN).
Json reading(const ReferenceFigure& figure, double ours, double coarse, double other, double least) {
    const double noise = std::abs(other - ours), change = std::abs(coarse - ours),
                 grid = std::isnan(change) ? change : std::max(least, change);
    const double deviation = ours - figure.reference, bars = noise + std::fmax(grid, least) + figure.bar;
    return {{"label", figure.label},
            {"unit", figure.unit},
            {"x", number_or_null(figure.x)},
            {"role", figure.role},
            {"why", figure.why},
            {"ours", number_or_null(ours, kDigits)},
            {"noise", number_or_null(noise, 2)},
            {"grid", number_or_null(grid, 2)},
            {"reference", number_or_null(figure.reference, 8)},
            {"reference_bar", number_or_null(figure.bar, 2)},
            {"deviation", number_or_null(deviation, 3)},
            {"deviation_percent", number_or_null(100.0 * deviation / std::abs(figure.reference), 3)},
            {"within_bars", std::abs(deviation) <= bars}};
}

Json profile_chart(const ValidationCase& one, std::size_t row, const fs::path& run) {
    const Recipe recipe = case_recipe(one, {row});
    const MeasuredProfile profile =
        read_measured_profile((one.folder / one.figures[row].figure).string(), recipe.domain.length_unit);
    return chart_of_profile(contour_of(run, recipe, profile.time), profile, recipe.domain.length_unit);
}

Json validate_case(const ValidationCase& one, const ValidationOptions& options) {
    double seconds = 0.0, finest = std::numeric_limits<double>::infinity();
    std::vector<Json> readings(one.figures.size());
    Json profile;
    std::size_t number = 0;
    for (const std::vector<std::size_t>& rows : case_runs(one)) {
        const std::string suffix = ++number == 1 ? "" : fmt::format("-{}", number);
        const auto run = [&](const char* more, const std::vector<std::string>& changes) {
            return figures_of(one, {rows, suffix + more, changes}, options, seconds);
        };
        const Recipe recipe = case_recipe(one, rows);
        const double spacing = recipe.domain.grid_spacing;
        finest = std::min(finest, spacing);
        const std::vector<double> ours = run("", {}),
                                  coarse =
                                      run("-coarse", {fmt::format("domain.grid_spacing={}", 2.0 * spacing)}),
                                  other = traces(recipe) ? run("-seed", {"flux.seed=2"}) : ours;
        for (std::size_t k = 0; k < rows.size(); ++k) {
            const ReferenceFigure& figure = one.figures[rows[k]];
            const bool length =
                !figure.is_of_surface() && (figure.unit == recipe.domain.length_unit || figure.per != 1.0);
            readings[rows[k]] = reading(figure, ours[k], coarse[k], other[k],
                                        length ? kResolution * spacing / std::abs(figure.per) : 0.0);
            if (figure.is_profile() && profile.is_null())
                profile = profile_chart(one, rows[k], options.output / (one.name + suffix));
        }
    }
    Json json{{"name", one.name},     {"title", one.title},   {"source", one.source},
              {"note", one.note},     {"fitted", one.fitted}, {"grid_spacing", finest},
              {"recipe", one.recipe}, {"table", one.table},   {"seconds", number_or_null(seconds, 3)},
              {"version", version()}, {"readings", readings}};
    json["chart"] = profile.is_null() ? chart_of_figures(json["readings"], one.x_axis) : profile;
    json["chart"]["title"] = one.name;
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

// Sentences on why figures of a case lie outside of their bars, one for each reason.
std::string reasons(const Json& readings) {
    std::vector<std::pair<std::string, std::string>> by_reason;  // reason and labels, in order of rows
    for (const Json& reading : readings) {
        if (reading.at("within_bars").get<bool>() || reading.at("role") == "fitted") continue;
        const auto label = reading.at("label").get<std::string>(), why = reading.at("why").get<std::string>();
        const auto same = std::ranges::find(by_reason, why, &std::pair<std::string, std::string>::first);
        if (same == by_reason.end())
            by_reason.emplace_back(why, label);
        else
            same->second += "; " + label;
    }
    std::string text;
    for (const auto& [why, labels] : by_reason)
        text += fmt::format("\nOutside: {}. {}\n", labels, why.empty() ? "Not explained." : why);
    return text;
}

// The section of the page about a case. Throws Json::exception if its entry of the report is damaged.
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
        const auto role = reading.at("role").get<std::string>();
        const Json& percent = reading.at("deviation_percent");  // null if the reference is 0
        const char* within = reading.at("within_bars").get<bool>() ? "yes" : "no";
        std::string label = reading.at("label").get<std::string>();
        std::ranges::replace(label, '|', '/');  // '|' would end a cell of the table
        const auto error = [&](const char* name) {
            const Json& of = reading.at(name);
            return of.is_null() ? "unknown" : fmt::format("{:.2g}", of);
        };
        page +=
            fmt::format("| {}{} | {:.5g} | {} | {} | {:.6g}{} | {} | {} |\n", label,
                        unit == "1" ? "" : ", in " + unit, reading.at("ours"), error("noise"), error("grid"),
                        reading.at("reference"), bar > 0.0 ? fmt::format(" +- {:.2g}", bar) : "",
                        percent.is_null() ? "" : fmt::format("{:.2g} %", percent),
                        role.empty()       ? within
                        : role == "fitted" ? role
                                           : fmt::format("{}, {}", within, role));
    }
    const auto note = row.at("note").get<std::string>(), fitted = row.at("fitted").get<std::string>();
    return page + reasons(row.at("readings")) +
           fmt::format("\nReference: {}. Grid spacing {:.5g}.{}{}\n\n![{}](validation/{}.svg)\n",
                       row.at("source"), row.at("grid_spacing"),
                       fitted.empty() ? "" : fmt::format(" Fitted: {}.", fitted),
                       note.empty() ? "" : " " + note, row.at("chart").at("title"), row.at("name"));
}

// The entries of an existing report, by case, for cases whose files have not changed.
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

// The page in Markdown: \p frame, with the sections of all cases in place of its line CASES.
std::string validation_page(const Json& validation, const std::string& frame) {
    std::string sections;
    std::size_t figures = 0, within = 0, fitted = 0, same = 0;
    for (const Json& row : validation["cases"]) {
        sections += section_of(row);
        for (const Json& reading : row["readings"]) {
            fitted += reading["role"] == "fitted" ? 1 : 0;
            same += reading["role"] == kSame ? 1 : 0;
            if (reading["role"] == "fitted" || reading["role"] == kSame) continue;
            within += reading["within_bars"].get<bool>() ? 1 : 0;
            ++figures;
        }
    }
    const std::string mark = "CASES\n";
    const std::size_t at = std::min(frame.find(mark), frame.size());
    std::string rest;
    if (fitted > 0) rest += fmt::format(" {} more were fitted and are not counted.", fitted);
    if (same > 0)
        rest +=
            fmt::format(" {} more are the same number that the recipe was given, and are not counted.", same);
    return fmt::format("{}Of {} figures of {} cases {} lie within.{}\n{}{}", frame.substr(0, at), figures,
                       validation["cases"].size(), within, rest, sections,
                       frame.substr(std::min(at + mark.size(), frame.size())));
}

constexpr const char* kHistoryColumns = "version,case,figure,unit,ours,reference,within\n";

// Checks, before the first run, that an existing file is such a history.
void check_history(const fs::path& file) {
    if (file.empty() || !is_there(file)) return;
    if (!fs::is_regular_file(file) || !surface::read_whole_file(file).starts_with(kHistoryColumns))
        throw FileError("{}: is no history of validate, and would be overwritten: name another file",
                        file.string());
}

// Replaces the rows of this version's cases in the table of all versions' figures; all other rows stay.
void write_history(const fs::path& file, const Json& validation) {
    std::string text = kHistoryColumns;
    if (is_there(file)) {
        for (const std::vector<std::string>& row : read_text_table(file).rows) {
            const bool again =
                row.size() < 2 ||
                (row[0] == version() && std::any_of(validation["cases"].begin(), validation["cases"].end(),
                                                    [&](const Json& one) { return one["name"] == row[1]; }));
            for (std::size_t k = 0; k < row.size() && !again; ++k)
                text += csv_field(row[k]) + (k + 1 < row.size() ? "," : "\n");
        }
    }
    for (const Json& one : validation["cases"])
        for (const Json& reading : one["readings"])
            text += fmt::format("{},{},{},{},{},{},{}\n", one["version"], one["name"],
                                csv_field(reading["label"].get<std::string>()),
                                csv_field(reading["unit"].get<std::string>()), reading["ours"],
                                reading["reference"],
                                reading["role"] == "fitted"          ? "fitted"
                                : reading["within_bars"].get<bool>() ? "yes"
                                                                     : "no");
    write_file(file, text);
}

}  // namespace

Json validate(const ValidationOptions& options) {
    const std::vector<ValidationCase> all = validation_cases(options.folder),
                                      cases = chosen(all, options.cases);
    for (const ValidationCase& one : cases)  // finds mistakes before the first run
        for (const std::vector<std::size_t>& rows : case_runs(one)) case_recipe(one, rows);
    check_history(options.history);
    const fs::path page = options.folder / "page.md";
    const std::string frame = is_there(page) ? surface::read_whole_file(page) : "# Validation\n\n";
    std::map<std::string, Json> rows = earlier_rows(options.output, all);
    Json validation;
    for (const ValidationCase& one : cases) {
        const Json& row = rows[one.name] = validate_case(one, options);
        if (options.finished) options.finished(row);
        write_file(options.output / "validation" / (one.name + ".svg"), chart_svg(row["chart"]));
        validation = Json{{"version", version()}, {"cases", Json::array()}};
        for (const ValidationCase& any : all)
            if (rows.contains(any.name)) validation["cases"].push_back(rows[any.name]);
        // Written after every case, so that finished ones are kept if a later one is interrupted.
        write_json((options.output / kReport).string(), validation);
        write_file(options.output / "validation.md", validation_page(validation, frame));
        if (!options.history.empty()) write_history(options.history, validation);
    }
    return validation;
}

}  // namespace sidewall::app
