#include "app/evaluation/validate_cases.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "app/fit/fit_profile.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/step_model.hpp"
#include "app/schema/keys.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Columns of reference.csv and the members they fill.
const std::vector<std::pair<std::string, std::string ReferenceFigure::*>> kTexts = {
    {"figure", &ReferenceFigure::figure}, {"label", &ReferenceFigure::label},
    {"unit", &ReferenceFigure::unit},     {"role", &ReferenceFigure::role},
    {"why", &ReferenceFigure::why},       {"where", &ReferenceFigure::where}};
const std::vector<std::pair<std::string, double ReferenceFigure::*>> kNumbers = {
    {"reference", &ReferenceFigure::reference},
    {"bar", &ReferenceFigure::bar},
    {"x", &ReferenceFigure::x},
    {"per", &ReferenceFigure::per},
    {"z_from", &ReferenceFigure::z_from},
    {"z_to", &ReferenceFigure::z_to},
    {"radius", &ReferenceFigure::radius},
    {"opening", &ReferenceFigure::opening}};
constexpr std::string_view kSet = "set:";  // begins the name of a column that sets a key of the recipe

[[noreturn]] void refuse(const std::string& place, const std::string& rule) {
    throw FileError("{}: {}", place, rule);
}

void require_known(const std::string& place, const std::string& what, const std::string& name,
                   const std::vector<std::string>& known) {
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    const std::string all = known.empty() ? ": the recipe's first step traces nothing"
                                          : fmt::format("; there are {}", fmt::join(known, ", "));
    refuse(place, fmt::format("{} \"{}\": there is none{}", what, surface::printable(name),
                              did_you_mean(": ", name, known, all)));
}

// Reads a comment line that describes the case, such as "# title: what is checked"; ignores others.
void read_comment(ValidationCase& one, std::string_view comment, const std::string& place) {
    const std::size_t colon = comment.find(':');
    if (colon == std::string_view::npos) return;
    const std::string_view key = trimmed(comment.substr(1, colon - 1));
    const std::string value(trimmed(comment.substr(colon + 1)));
    if (key == "title") one.title = value;
    if (key == "source") one.source = value;
    if (key == "note") one.note += (one.note.empty() ? "" : " ") + value;
    if (key == "fitted") one.fitted = value;
    if (key == "x") one.x_axis = value;
    if (key != "order") return;
    if (!finite_number(value)) refuse(place, "order must be a number, as the case's place in the report");
    one.order = *finite_number(value);
}

ReferenceFigure read_row(const std::vector<std::string>& names, const std::vector<std::string>& fields,
                         const std::string& place) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    if (fields.size() != names.size())
        refuse(place, fmt::format("{} values under {} names: put a value with commas in quotes",
                                  fields.size(), names.size()));
    ReferenceFigure figure;
    figure.place = place;
    figure.reference = figure.bar = kNone;
    for (std::size_t k = 0; k < names.size(); ++k) {
        const std::string_view value = trimmed(fields[k]);
        if (names[k].starts_with(kSet) && !value.empty())
            figure.settings.push_back(fmt::format("{}={}", names[k].substr(kSet.size()), value));
        for (const auto& [name, text] : kTexts)
            if (name == names[k]) figure.*text = value;
        for (const auto& [name, number] : kNumbers) {
            if (name != names[k] || value.empty()) continue;
            if (!finite_number(value))
                refuse(place, fmt::format("\"{}\" under {} is not a finite number",
                                          surface::printable(fields[k]), name));
            figure.*number = *finite_number(value);
        }
    }
    if (figure.figure.empty() || figure.label.empty() || figure.unit.empty() ||
        std::isnan(figure.reference + figure.bar))
        refuse(place, "a row needs values under figure, label, unit, reference and bar");
    if (!figure.role.empty())
        require_known(place, "role", figure.role, {"fitted", "held out", "same number"});
    if (figure.per == 0.0) refuse(place, "per is 0: it is what the figure is divided by");
    return figure;
}

std::vector<std::string> read_names(std::vector<std::string> names, const std::string& place) {
    std::vector<std::string> known;
    known.reserve(std::size(kTexts) + std::size(kNumbers));
    for (const auto& [name, member] : kTexts) known.push_back(name);
    for (const auto& [name, member] : kNumbers) known.push_back(name);
    for (std::string& name : names) {
        name = std::string(trimmed(name));
        if (!name.starts_with(kSet)) require_known(place, "column", name, known);
    }
    return names;
}

ValidationCase read_case(const fs::path& folder) {
    ValidationCase one;
    one.folder = folder;
    one.name = folder.filename().string();
    const fs::path table = folder / "reference.csv";
    for (const fs::path& file : {folder / "recipe.toml", table})
        if (!is_there(file))
            refuse(file.string(), "is missing: a case is a folder with recipe.toml and reference.csv");
    one.recipe = surface::read_whole_file(folder / "recipe.toml");
    one.table = surface::read_whole_file(table);
    std::vector<std::string> names;
    std::size_t number = 0;
    for (const std::string& text : split(one.table, '\n')) {
        const std::string place = fmt::format("{}:{}", table.string(), ++number);
        const std::string_view line = trimmed(text);
        if (line.starts_with('#'))
            read_comment(one, line, place);
        else if (!line.empty() && names.empty())
            names = read_names(csv_rows(line).front(), place);
        else if (!line.empty())
            one.figures.push_back(read_row(names, csv_rows(line).front(), place));
    }
    if (one.title.empty() || one.source.empty() || one.figures.empty())
        refuse(table.string(),
               "needs lines \"# title: ...\" and \"# source: ...\", one of names, and a row a figure");
    const bool fits = std::any_of(one.figures.begin(), one.figures.end(),
                                  [](const ReferenceFigure& row) { return row.role == "fitted"; });
    if (fits == one.fitted.empty())
        refuse(table.string(),
               "a line \"# fitted: which parameter, to which rows\" and rows of the role \"fitted\" "
               "go together");
    return one;
}

void require_attribute(const Recipe& recipe, const ReferenceFigure& figure) {
    std::vector<std::string> attributes, places = material_names(recipe.materials);
    places.insert(places.begin(), {"floor", "wall"});
    const Model model = make_model(expanded_steps(recipe).front(), recipe.materials, recipe.domain);
    for (const std::string& name : flux_names(model.species)) attributes.push_back("flux_" + name);
    for (const std::string& name : model.coverages.names) attributes.push_back("coverage_" + name);
    require_known(figure.place, "figure", figure.figure, attributes);
    if (!figure.where.empty()) require_known(figure.place, "where", figure.where, places);
}

}  // namespace

fs::path shipped_cases() {
    fs::path folder = shipped_folder("configs/validation");
    if (!folder.empty()) return folder;
    throw FileError(
        "no folder above the program holds share/sidewall/configs/validation or configs/validation: say with "
        "--cases DIR where the cases are");
}

std::vector<ValidationCase> validation_cases(const fs::path& folder) {
    std::error_code failure;
    std::vector<ValidationCase> cases;
    for (const auto& entry : fs::directory_iterator(folder, failure))
        if (entry.is_directory(failure)) cases.push_back(read_case(entry.path()));
    if (cases.empty())
        refuse(folder.string(),
               "holds no case, a folder with recipe.toml and reference.csv: name another with --cases");
    std::sort(cases.begin(), cases.end(), [](const ValidationCase& a, const ValidationCase& b) {
        return std::tie(a.order, a.name) < std::tie(b.order, b.name);
    });
    return cases;
}

std::vector<std::vector<std::size_t>> case_runs(const ValidationCase& one) {
    std::vector<std::vector<std::size_t>> runs;
    for (std::size_t k = 0; k < one.figures.size(); ++k) {
        const auto same = std::find_if(runs.begin(), runs.end(), [&](const std::vector<std::size_t>& rows) {
            return one.figures[rows.front()].settings == one.figures[k].settings;
        });
        if (same == runs.end())
            runs.push_back({k});
        else
            same->push_back(k);
    }
    return runs;
}

Recipe case_recipe(const ValidationCase& one, const std::vector<std::size_t>& rows,
                   const std::vector<std::string>& changes) {
    std::vector<std::string> all = one.figures[rows.front()].settings;
    all.insert(all.end(), changes.begin(), changes.end());
    Recipe recipe = parse_recipe(one.recipe, (one.folder / "recipe.toml").string(), all);
    for (const std::size_t row : rows) {
        const ReferenceFigure& figure = one.figures[row];
        if (figure.is_of_surface()) {
            require_attribute(recipe, figure);
        } else if (figure.is_profile()) {
            require_wafer_size(
                read_measured_profile((one.folder / figure.figure).string(), recipe.domain.length_unit),
                recipe);
        } else {
            want_figure(recipe, figure.figure, figure.place + ": figure", figure.figure);
        }
    }
    return recipe;
}

}  // namespace sidewall::app
