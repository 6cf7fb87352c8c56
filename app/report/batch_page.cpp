#include <fmt/ranges.h>

#include <cctype>
#include <set>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/fit/fit_report.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/sections.hpp"
#include "app/report/parts.hpp"
#include "surface/error.hpp"

// Pages of folders with many runs: sweeps and fits.
namespace sidewall::app {
namespace {

// The keys in the --vary options of a plan, which read KEY=LO:HI... or KEY=V1,V2.
std::vector<std::string> varied_keys(const Json& plan) {
    std::vector<std::string> keys;
    for (const Json& text : plan.value("vary", Json::array()))
        keys.push_back(split(text.get<std::string>(), '=').front());
    return keys;
}

std::string short_value(const std::string& field) {
    const Json value = field_json(field);
    return value.is_number() ? number_text(value, 4) : field;
}

// Final surface of each successful run in a table, labelled with the values of its keys.
std::vector<ViewFrame> final_surfaces(const fs::path& folder, const TextTable& table,
                                      const std::vector<std::string>& keys) {
    std::vector<ViewFrame> frames;
    std::set<std::string> seen;
    const auto run = table.column("run"), status = table.column("status");
    for (const auto& row : table.rows) {
        if (!run || (status && row[*status] != "ok") || !seen.insert(row[*run]).second) continue;
        std::string label = "run " + row[*run];
        for (const std::string& key : keys)
            if (const auto k = table.column(key))
                label += fmt::format(", {} = {}", key, short_value(row[*k]));
        if (auto frame = last_frame(folder / "runs" / row[*run], label)) frames.push_back(*std::move(frame));
    }
    return frames;
}

// Varied keys with their columns in a table; these follow the columns run and recipe.
Json keys_of(const TextTable& table, const Json& plan, const Json& units) {
    Json all = Json::array();
    for (const std::string& key : varied_keys(plan))
        all.push_back(Json{{"column", table.column(key).value_or(all.size() + 1)},
                           {"name", key},
                           {"label", axis_label(key, text_at(units, key))},
                           {"log", plan["vary"][all.size()].get<std::string>().ends_with(":log")}});
    return all;
}

// Measures of a table: its columns between the keys and the seconds.
Json measures_of(const TextTable& table, const Json& keys, const Json& units) {
    Json measures = Json::array();
    const std::size_t last = keys.empty() ? 0 : keys.back()["column"].get<std::size_t>();
    for (std::size_t k = last + 1; k < table.names.size(); ++k)
        if (table.names[k] != "seconds" && table.names[k] != "status")
            measures.push_back(Json{{"column", k},
                                    {"name", table.names[k]},
                                    {"label", axis_label(table.names[k], text_at(units, table.names[k]))}});
    return measures;
}

// Adds the units of the varied keys, from a run's recipe, to those of the measures.
void add_key_units(const fs::path& effective, const Json& plan, Json& units) {
    try {
        const Recipe recipe = load_recipe(effective);
        const std::vector<KeyDoc> keys = settable_keys(recipe);
        for (const std::string& key : varied_keys(plan)) units[key] = unit_of_key(keys, recipe, key);
    } catch (const Error&) {  // files that the recipe names may be gone
    }
}

// Contours of figures over two keys, with the lines where targets of a fit are met, and its best values.
Json contour_section(const TextTable& table, const Json& plan) {
    Json section{{"type", "contour"}, {"title", "Contours over both keys"}, {"targets", Json::array()}};
    section["note"] = "Dots are runs; figures are interpolated linearly between them.";
    const Json residuals = plan.value("residuals", Json::object());
    for (const auto& [name, target] : residuals.items())
        if (const auto column = table.column(name))
            section["targets"].push_back(
                {{"name", name}, {"column", *column}, {"value", target.at("asked")}});
    if (plan.contains("parameters"))
        for (const std::string& key : varied_keys(plan))
            section["best"].push_back(plan["parameters"].at(key).at("value"));
    return section;
}

// Adds response curves, contours, scatter matrix and table, which share their rows.
void add_table(const TextTable& table, const Json& plan, const Json& units, const std::string& curves,
               Page& page) {
    Json rows = table_section("All runs", table, units);
    const Json keys = keys_of(table, plan, units),
               shared{{"keys", keys}, {"measures", measures_of(table, keys, units)}};
    if (keys.size() == 2 && !table.column("recipe")) {
        page.sections.push_back(contour_section(table, plan));
        page.sections.back().update(shared);
    }
    for (const auto& [type, title] : {std::pair("response", curves), {"matrix", "Scatter matrix"}}) {
        page.sections.push_back(Json{{"type", type}, {"title", title}});
        page.sections.back().update(shared);
    }
    rows["source"] = true;  // the other sections draw these rows
    page.sections.push_back(std::move(rows));
}

std::string joined(const Json& list) {
    return list.is_array() ? fmt::format("{}", fmt::join(list.get<std::vector<std::string>>(), ", ")) : "";
}

std::size_t failures(const TextTable& table) {
    const auto status = table.column("status");
    std::size_t count = 0;
    for (const auto& row : table.rows) count += status && row[*status] != "ok" ? 1 : 0;
    return count;
}

std::string sentence(std::string remark) {
    remark.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(remark.front())));
    return remark + ".";
}

// Fitted values with their 95 % intervals and the bounds of the search.
Json parameters_section(const Json& fit) {
    Json section{{"type", "intervals"}, {"title", "Parameters"}, {"rows", Json::array()}};
    for (const auto& [key, parameter] : fit.at("parameters").items()) {
        Json row{{"name", key},
                 {"value", parameter.at("value")},
                 {"interval", parameter.at("interval95")},
                 {"unit", shown_unit(text_at(parameter, "unit"))},
                 {"at_bound", parameter.contains("at_bound")}};
        for (const Json& text : fit.value("vary", Json::array())) {
            const auto parts = split(text.get<std::string>(), '=');
            const auto bounds = split(parts.back(), ':');
            if (parts.front() != key || bounds.size() < 2) continue;
            row["bounds"] = Json::array({field_json(bounds[0]), field_json(bounds[1])});
            row["log"] = bounds.back() == "log";
        }
        section["rows"].push_back(std::move(row));
    }
    if (fit.contains("noise_runs")) section["note"] = sentence(noise_remark(fit));
    return section;
}

Json residuals_section(const Json& fit) {
    Json rows = Json::array();
    bool sigmas = false;
    for (const auto& [name, r] : fit.at("residuals").items()) {
        const bool known = r.at("asked").is_number() && r.at("got").is_number();
        const Json residual =
            known ? number_or_null(r.at("got").get<double>() - r.at("asked").get<double>(), 4) : Json();
        const Json scaled = known && r.at("sigma").is_number()
                                ? number_or_null(residual.get<double>() / r.at("sigma").get<double>(), 4)
                                : Json();
        sigmas = sigmas || r.at("sigma").is_number();
        rows.push_back(Json::array({name, r.at("asked"), r.at("got"), residual, r.value("noise", Json()),
                                    r.at("sigma"), scaled, shown_unit(text_at(r, "unit"))}));
    }
    std::vector<std::string> columns{"target",           "asked", "got", "residual", "noise", "sigma",
                                     "residual / sigma", "unit"};
    if (!sigmas) {
        columns.erase(columns.begin() + 5, columns.begin() + 7);
        for (Json& row : rows) row.erase(row.begin() + 5, row.begin() + 7);
    }
    return plain_table("Targets and residuals", columns, std::move(rows));
}

// Charts of measured and simulated profiles of a fit, from overlay*.csv.
Json overlays_section(const fs::path& folder) {
    std::set<fs::path> files;
    std::error_code unreadable;
    for (const auto& entry : fs::directory_iterator(folder, unreadable))
        if (entry.path().extension() == ".csv" && entry.path().filename().string().starts_with("overlay"))
            files.insert(entry.path());
    Json charts = Json::array();
    for (const fs::path& file : files) {
        const TextTable table = read_text_table(file);
        if (table.names.size() != 3) continue;
        Json series = Json::array();
        for (const auto& row : table.rows) {
            if (series.empty() || series.back()["name"] != row[0])
                series.push_back({{"name", row[0]}, {"dots", series.empty()}, {"points", Json::array()}});
            series.back()["points"].push_back({field_json(row[1]), field_json(row[2])});
        }
        const auto label = [&](std::size_t column) {
            const auto [name, unit] = name_and_unit(table.names[column]);
            return axis_label(name, unit);
        };
        charts.push_back({{"title", file.stem().string()},
                          {"x", label(1)},
                          {"y", label(2)},
                          {"same_scale", true},
                          {"series", std::move(series)}});
    }
    return charts_section("Measured and simulated profiles", std::move(charts), true);
}

void add_fit_result(const fs::path& folder, const Json& fit, Page& page) {
    for (const std::string& remark : fit_remarks(fit)) page.notes.push_back(sentence(remark));
    page.sections.push_back(parameters_section(fit));
    page.sections.push_back(residuals_section(fit));
    Json overlays = overlays_section(folder);
    if (!overlays["charts"].empty()) page.sections.push_back(std::move(overlays));
    if (fit.contains("correlation") && fit["correlation"].size() > 1)
        page.sections.push_back(
            Json{{"type", "correlation"}, {"title", "Correlations"}, {"matrix", fit["correlation"]}});
}

}  // namespace

Page sweep_page(const fs::path& folder, std::size_t bytes) {
    Page page{.kind = "sweep", .title = folder_name(folder), .notes{}};
    const Json plan = read_json(folder / "sweep.json", "make the sweep again");
    Json units = plan.value("units", Json::object());
    page.fact("Recipe", text_at(plan, "recipe"));
    page.fact("Design", text_at(plan, "design"));
    page.fact("Varied", joined(plan.value("vary", Json())));
    page.fact("Set", joined(plan.value("set", Json())));
    page.fact("Version", text_at(plan, "version"));
    TextTable table;
    if (is_there(folder / "sweep.csv")) table = read_text_table(folder / "sweep.csv");
    const auto rows = plan.value("rows", std::size_t{0});
    page.fact("Rows", fmt::format("{} of {}", table.rows.size(), rows));
    if (table.rows.size() < rows)
        page.notes.push_back(
            fmt::format("The sweep has not ended: {} of {} rows are done; continue with --resume.",
                        table.rows.size(), rows));
    if (const std::size_t failed = failures(table); failed > 0)
        page.notes.push_back(
            fmt::format("{} runs failed: see the column status of the table for the reason.", failed));
    if (table.rows.empty()) return page;
    const fs::path first = folder / "runs" / table.rows[0][table.column("run").value_or(0)] / "recipe.toml";
    add_key_units(first, plan, units);
    add_table(table, plan, units, "Response curves", page);
    add_view(final_surfaces(folder, table, varied_keys(plan)), first, bytes, "Final surfaces",
             "Final profiles", page);
    page.sections.push_back(recipe_section("Recipe of the first run", first, text_at(plan, "recipe")));
    return page;
}

Page fit_page(const fs::path& folder, std::size_t bytes) {
    Page page{.kind = "fit", .title = folder_name(folder), .notes{}};
    const Json fit = read_json(folder / "fit.json", "make the fit again");
    page.fact("Recipe", text_at(fit, "recipe"));
    page.fact("Status", text_at(fit, "status"));
    page.fact("Method", text_at(fit, "method"));
    page.fact("Varied", joined(fit.value("vary", Json())));
    page.fact("Targets", joined(fit.value("target", Json())));
    page.fact("Profiles", joined(fit.value("target_profile", Json())));
    page.fact("Set", joined(fit.value("set", Json())));
    if (fit.contains("runs")) page.fact("Runs", number_text(fit["runs"]));
    page.fact("Best run", text_at(fit, "best_run"));
    page.fact("Errors from", text_at(fit, "errors_from"));
    page.fact("Version", text_at(fit, "version"));
    if (fit.contains("parameters"))
        add_fit_result(folder, fit, page);
    else
        page.notes.emplace_back(
            "The fit has not ended: the page shows its runs so far; continue with --resume.");
    TextTable table;
    if (is_there(folder / "fit.csv")) table = read_text_table(folder / "fit.csv");
    const std::string best = text_at(fit, "best_run");
    const auto keys = varied_keys(fit);
    if (!table.rows.empty()) {
        const auto frames = final_surfaces(folder, table, keys);
        std::vector<ViewFrame> shown;
        if (!frames.empty()) shown.push_back(frames.front());
        for (const ViewFrame& frame : frames)
            if (frame.label.starts_with("run " + best + ",") && frame.label != shown.front().label)
                shown.push_back(frame);
        if (shown.size() == 2) shown[1].label = "best: " + shown[1].label;
        add_view(std::move(shown), folder / "runs" / table.rows[0][0] / "recipe.toml", bytes,
                 "Final surfaces", "Final profiles", page);
        Json units = Json::object();
        const fs::path any = folder / "runs" / (best.empty() ? table.rows[0][0] : best);
        if (is_there(any / "summary.json"))
            units = read_summary(any).value("metrology_units", Json::object());
        add_key_units(any / "recipe.toml", fit, units);
        add_table(table, fit, units, "Figures of all runs over the keys", page);
    }
    const Json several = fit.value("best_runs", Json::object());  // by recipe; empty for a single recipe
    for (const auto& [label, number] : several.items())
        page.sections.push_back(recipe_section(fmt::format("Best values of {}", label),
                                               folder / fmt::format("best_{}.toml", label), ""));
    if (several.empty())
        page.sections.push_back(
            recipe_section("Recipe and best values", folder / "best.toml", text_at(fit, "recipe")));
    return page;
}

}  // namespace sidewall::app
