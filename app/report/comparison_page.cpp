#include <fmt/format.h>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/timing.hpp"
#include "app/evaluation/compare.hpp"
#include "app/report/parts.hpp"

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
    const auto row = [&](const std::string& name, auto&& value, const Json& floor) {
        Json fields = Json::array({name});
        for (const Json& variant : comparison.at("variants")) fields.push_back(value(variant));
        fields.push_back(floor);
        rows.push_back(std::move(fields));
    };
    const std::string cell = "grid spacings";
    row(
        "total time [s]", [](const Json& v) { return v.at("timing").at("total"); }, Json());
    row(
        "tracing time [s]", [](const Json& v) { return v.at("timing").at("trace"); }, Json());
    row(
        "flux at equal error [s]",
        [](const Json& v) { return number_or_null(v.at("flux_seconds_at_equal_error"), 4); }, Json());
    row(
        "relative flux error (statistical)", [](const Json& v) { return v.at("relative_error"); }, Json());
    row(
        "triangles traced", [](const Json& v) { return v.at("mesh").at("simplified").at("triangles"); },
        Json());
    for (const char* name : {"hausdorff_max", "hausdorff_mean"})
        row(
            fmt::format("distance to the raw run, {} [{}]", name + 10, cell),
            [&](const Json& v) { return number_or_null(v.at("final").at(name), 4); },
            number_or_null(comparison.at("noise_floor").at(name), 4));
    const Json& first = comparison.at("variants").at(0).at("metrology");
    for (const auto& [name, ignored] : first.items())
        row(
            with_unit(name, text_at(units, name)),
            [&key = name](const Json& v) { return v.at("metrology").value(key, Json()); }, Json());
    Json section = plain_table("Methods against each other", columns, std::move(rows));
    section["note"] = compare_verdict(comparison);
    return section;
}

Json phases(const Json& comparison) {
    Json section{{"type", "bars"}, {"title", "Time by phase"}, {"unit", "s"}, {"rows", Json::array()}};
    section["names"] = names_of(comparison);
    for_each_phase([&](const char* phase, double Timing::*) {
        if (std::string_view(phase) == "total") return;
        Json row = Json::array({phase});
        for (const Json& variant : comparison.at("variants")) row.push_back(variant.at("timing").at(phase));
        section["rows"].push_back(std::move(row));
    });
    return section;
}

Json distances(const Json& comparison) {
    Json section{
        {"type", "bars"}, {"title", "Distance to the raw run's final surface"}, {"unit", "grid spacings"}};
    section["names"] = Json::array({"largest", "mean"});
    section["rows"] = Json::array();
    const auto add = [&](const std::string& name, const Json& of) {
        section["rows"].push_back(Json::array({name, of.at("hausdorff_max"), of.at("hausdorff_mean")}));
    };
    for (const Json& variant : comparison.at("variants"))
        if (variant.at("method") != "none") add(shown_method(variant), variant.at("final"));
    add("noise floor", comparison.at("noise_floor"));
    return section;
}

}  // namespace

Page comparison_page(const fs::path& folder, std::size_t bytes) {
    Page page("comparison", folder_name(folder));
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
    add_view(std::move(frames), folder / "none" / "recipe.toml", bytes, "Final surfaces", "Final profiles",
             page);
    page.sections.push_back(recipe_section("Recipe of the raw run", folder / "none" / "recipe.toml",
                                           text_at(comparison, "recipe")));
    return page;
}

}  // namespace sidewall::app
