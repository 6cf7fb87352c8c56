#include <fmt/format.h>

#include <map>
#include <tuple>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/timing.hpp"
#include "app/evaluation/compare.hpp"
#include "app/report/parts.hpp"
#include "surface/files/file.hpp"

// Pages of comparisons and studies of simplification methods, and of validations.
namespace sidewall::app {
namespace {

std::string shown_method(const Json& variant) {
    const std::string method = variant.at("method").get<std::string>();
    return method == "none" ? "raw" : method;
}

Json names_of(const Json& comparison) {
    Json names = Json::array();
    for (const Json& variant : comparison.at("variants")) names.push_back(shown_method(variant));
    return names;
}

// A table with a row for each figure and a column for each method and for the noise floor.
Json comparison_table(const Json& comparison, const Json& units) {
    std::vector<std::string> columns{"figure"};
    for (const Json& name : names_of(comparison)) columns.push_back(name);
    columns.emplace_back("noise floor");
    Json rows = Json::array();
    // Adds a row: the value at a JSON pointer in each variant, to four digits if rounded, and the noise
    // floor.
    const auto row = [&](const std::string& name, const Json::json_pointer& pointer, bool rounded = false,
                         const Json& floor = {}) {
        const auto shown = [&](const Json& value) {
            return rounded && value.is_number() ? number_or_null(value.get<double>(), 4) : value;
        };
        Json fields = Json::array({name});
        for (const Json& variant : comparison.at("variants"))
            fields.push_back(shown(variant.value(pointer, Json())));
        fields.push_back(shown(floor));
        rows.push_back(std::move(fields));
    };
    row("total time [s]", "/timing/total"_json_pointer);
    row("tracing time [s]", "/timing/trace"_json_pointer);
    row("flux at equal error [s]", "/flux_seconds_at_equal_error"_json_pointer, true);
    row("relative flux error (statistical)", "/relative_error"_json_pointer);
    row("triangles traced", "/mesh/simplified/triangles"_json_pointer);
    for (const std::string name : {"max", "mean"})
        row(fmt::format("distance to the raw run, {} [grid spacings]", name),
            Json::json_pointer("/final/hausdorff_" + name), true,
            comparison.at("noise_floor").at("hausdorff_" + name));
    for (const auto& [name, ignored] : comparison.at("variants").at(0).at("metrology").items())
        row(with_unit(name, text_at(units, name)), Json::json_pointer("/metrology") / name);
    Json section = plain_table("Comparison of methods", columns, std::move(rows));
    section["note"] = compare_verdict(comparison);
    return section;
}

Json bars(const char* title, const char* unit, Json names) {
    return {{"type", "bars"},
            {"title", title},
            {"unit", unit},
            {"names", std::move(names)},
            {"rows", Json::array()}};
}

Json phases(const Json& comparison) {
    Json section = bars("Time by phase", "s", names_of(comparison));
    const Json timing = Timing();
    for (const auto& [phase, none] : timing.items()) {
        if (phase == "total") continue;
        Json row = Json::array({phase});
        for (const Json& variant : comparison.at("variants")) row.push_back(variant.at("timing").at(phase));
        section["rows"].push_back(std::move(row));
    }
    return section;
}

Json distances(const Json& comparison) {
    Json section = bars("Distance to the raw run's final surface", "grid spacings", {"largest", "mean"});
    const auto add = [&](const std::string& name, const Json& of) {
        section["rows"].push_back({name, of.at("hausdorff_max"), of.at("hausdorff_mean")});
    };
    for (const Json& variant : comparison.at("variants"))
        if (variant.at("method") != "none") add(shown_method(variant), variant.at("final"));
    add("noise floor", comparison.at("noise_floor"));
    return section;
}

Json study_chart(const std::string& title, const char* x, const char* y) {
    return {{"title", title}, {"x", x}, {"y", y}, {"log_y", true}, {"series", Json::array()}};
}

// A chart of the value at a JSON pointer over the share of vertices removed, one line a method.
Json over_removal(const Json& surface, const char* title, const char* y, const char* pointer) {
    Json chart = study_chart(title, "vertices removed [%]", y);
    std::map<std::string, Json> lines;
    for (const Json& row : surface.at("rows"))
        lines[row.at("method").get<std::string>()].push_back(
            {100.0 * row.at("removal").get<double>(), row.value(Json::json_pointer(pointer), Json())});
    for (auto& [method, points] : lines)
        chart["series"].push_back({{"name", method}, {"marked", true}, {"points", std::move(points)}});
    return chart;
}

// A chart of the share of vertices that lie farther than d from the simplified mesh, at the largest removal.
Json distance_charts(const Json& surface) {
    Json chart = study_chart("Distances at the largest removal", "distance d [dx]",
                             "share of vertices farther than d [1]");
    chart["log_x"] = true;
    const Json& rows = surface.at("rows");
    for (const Json& row : rows)
        if (row.at("removal") == rows.back().at("removal"))
            chart["series"].push_back({{"name", row.at("method")}, {"points", row.at("exceedance")}});
    return chart;
}

}  // namespace

Page comparison_page(const fs::path& folder, std::size_t bytes) {
    Page page{.kind = "comparison", .title = folder_name(folder), .notes{}};
    const Json comparison = read_json(folder / "compare.json", "make the comparison again");
    page.fact("Recipe", text_at(comparison, "recipe"));
    page.fact("Grid spacing", fmt::format("{} {}", number_text(comparison.at("grid_spacing")),
                                          shown_unit(text_at(comparison, "length_unit"))));
    page.fact("Noise floor", "distance of two raw runs of different seeds");
    Json units = Json::object();
    if (is_there(folder / "none" / "summary.json"))
        units = read_summary(folder / "none").value("metrology_units", Json::object());
    page.sections.push_back(comparison_table(comparison, units));
    page.sections.push_back(phases(comparison));
    page.sections.push_back(distances(comparison));
    std::vector<ViewFrame> frames;
    for (const Json& variant : comparison.at("variants")) {
        const fs::path run = folder / variant.at("method").get<std::string>();
        if (auto frame = last_frame(run, shown_method(variant))) frames.push_back(*std::move(frame));
    }
    const fs::path raw = folder / "none" / "recipe.toml";
    add_view(std::move(frames), raw, bytes, "Final surfaces", "Final profiles", page);
    page.sections.push_back(recipe_section("Recipe of the raw run", raw, text_at(comparison, "recipe")));
    return page;
}

Page study_page(const fs::path& folder, std::size_t /*bytes*/) {
    Page page{.kind = "study", .title = folder_name(folder), .notes{}};
    const Json study = read_json(folder / "study.json", "make the study again");
    page.fact("Rays a trace", number_text(study.value("rays", Json())));
    page.fact("Sticking", number_text(study.value("sticking", Json())));
    page.fact("Threads", number_text(study.value("threads", Json())));
    page.fact("Version", text_at(study, "version"));
    if (is_there(folder / "report.md"))
        page.sections.push_back(Json{{"type", "markdown"},
                                     {"title", "Region simplification on process surfaces"},
                                     {"text", surface::read_whole_file(folder / "report.md")}});
    else
        page.notes.emplace_back("The study has not ended: it has no verdicts yet.");
    for (const Json& surface : study.at("surfaces")) {
        if (surface.at("rows").empty()) continue;
        Json charts = Json::array();
        for (const auto& [title, y, pointer] :
             {std::tuple{"Mean distance to the original", "distance [dx]", "/original_to_simplified/mean"},
              {"Largest distance to the original", "distance [dx]", "/original_to_simplified/max"},
              {"Simplification time", "CPU time [s]", "/seconds/simplification"},
              {"Tracing time", "CPU time [s]", "/trace/seconds/trace"}})
            charts.push_back(over_removal(surface, title, y, pointer));
        charts.insert(charts.begin() + 2, distance_charts(surface));
        page.sections.push_back(
            charts_section(fmt::format("Surface {}", surface.at("surface").get<int>()), std::move(charts)));
    }
    if (is_there(folder / "study.csv"))
        page.sections.push_back(
            table_section("All rows", read_text_table(folder / "study.csv"), Json::object()));
    return page;
}

Page validation_page(const fs::path& folder, std::size_t /*bytes*/) {
    Page page{.kind = "validation", .title = folder_name(folder), .notes{}};
    const Json validation = read_json(folder / "validation.json", "validate again");
    page.fact("Version", text_at(validation, "version"));
    Json rows = Json::array(), charts = Json::array();
    std::size_t within = 0, counted = 0;
    for (const Json& one : validation.at("cases")) {
        charts.push_back(one.at("chart"));
        for (const Json& reading : one.at("readings")) {
            const std::string role = text_at(reading, "role");
            const bool is_within = reading.at("within_bars").get<bool>();
            const bool counts = role != "fitted" && role != "same number";
            counted += counts ? 1 : 0;
            within += is_within && counts ? 1 : 0;
            rows.push_back({one.at("name"), reading.at("label"), reading.at("unit"), reading.at("ours"),
                            reading.at("noise"), reading.at("grid"), reading.at("reference"),
                            reading.at("reference_bar"),
                            role == "fitted" ? role
                            : is_within      ? "yes"
                                             : "no"});
        }
    }
    page.fact("Figures within their bars", fmt::format("{} of {}", within, counted));
    page.sections.push_back(charts_section("Cases", std::move(charts)));
    page.sections.push_back(plain_table(
        "Figures", {"case", "figure", "unit", "ours", "noise", "grid", "reference", "its bar", "within"},
        std::move(rows)));
    return page;
}

}  // namespace sidewall::app
