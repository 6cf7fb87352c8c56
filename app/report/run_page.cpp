#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/report/parts.hpp"
#include "app/results/result.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kMostPoints = 1000;  // most points of a curve

// The timeline of a run: curves over process time.
class Timeline {
  public:
    Timeline(const fs::path& path, const Json& summary) : summary_(summary) {
        if (is_there(path)) table_ = read_text_table(path);
        if (!table_.names.empty() && !table_.column("time"))
            throw FileError("{}: has no column time, it is damaged: run the simulation again", path.string());
        time_ = table_.column("time").value_or(0);
    }

    const TextTable& table() const { return table_; }
    std::string time_label() const { return axis_label("time", name_and_unit(table_.names[time_]).second); }

    /// Points [time, value] of a column. The value of a measure at the end of the run is in the summary only.
    Json points(std::size_t column) const {
        Json all = Json::array();
        const std::size_t stride =
            std::max<std::size_t>(1, (table_.rows.size() + kMostPoints - 1) / kMostPoints);
        for (std::size_t r = 0; r < table_.rows.size(); r += stride) add(table_.rows[r], column, all);
        if (stride > 1) add(table_.rows.back(), column, all);
        const std::string name = name_and_unit(table_.names[column]).first;
        if (summary_.contains("metrology") && summary_["metrology"].contains(name) &&
            summary_.contains("time"))
            all.push_back(Json::array({summary_["time"], summary_["metrology"][name]}));
        return all;
    }

    /// Start times of steps with their names; empty if there are over kMost.
    Json marks() const {
        constexpr std::size_t kMost = 20;
        Json marks = Json::array();
        const auto name = table_.column("name");
        for (std::size_t r = 0; name && r < table_.rows.size(); ++r) {
            const auto& row = table_.rows[r];
            if (r > 0 && row[*name] == table_.rows[r - 1][*name]) continue;
            const Json time = field_json(row[time_]);
            if (!marks.empty() && marks.back()[0] == time)  // the step before took no time
                marks.back()[1] = marks.back()[1].get<std::string>() + ", " + row[*name];
            else
                marks.push_back(Json::array({time, row[*name]}));
        }
        return marks.size() > kMost ? Json::array() : marks;
    }

    Json chart(const std::string& title, const std::string& y,
               const std::vector<std::pair<std::string, std::string>>& columns) const {
        Json chart{
            {"title", title}, {"x", time_label()}, {"y", y}, {"marks", marks()}, {"series", Json::array()}};
        for (const auto& [column, name] : columns)
            if (const auto k = table_.column(column))
                chart["series"].push_back(Json{{"name", name}, {"points", points(*k)}});
        return chart;
    }

  private:
    void add(const std::vector<std::string>& row, std::size_t column, Json& all) const {
        all.push_back(Json::array({field_json(row[time_]), field_json(row[column])}));
    }

    const Json& summary_;
    TextTable table_;
    std::size_t time_ = 0;
};

// Title of the chart that a measure shares, such as "film" for all measures film_*.
std::string family_of(const std::string& name) {
    std::string family = name;
    for (const char* start : {"film", "step_coverage", "cd_at", "scallop"})
        if (name.starts_with(fmt::format("{}_", start))) family = start;
    if (family == "cd_at") return "opening (cd)";
    std::replace(family.begin(), family.end(), '_', ' ');
    return family;
}

Json measure_charts(const Timeline& timeline) {
    const TextTable& table = timeline.table();
    Json charts = Json::array();
    const std::size_t first = table.column("relative_error").value_or(table.names.size()) + 1;
    std::map<std::string, std::size_t> place;
    for (std::size_t k = first; k < table.names.size(); ++k) {
        const auto [name, unit] = name_and_unit(table.names[k]);
        const std::string family = family_of(name);
        const auto [at, fresh] = place.try_emplace(family, charts.size());
        if (fresh) charts.push_back(timeline.chart(family, axis_label(family, unit), {}));
        charts[at->second]["series"].push_back(Json{{"name", name}, {"points", timeline.points(k)}});
    }
    return charts;
}

Json numerics_charts(const Timeline& timeline) {
    const auto speed = timeline.table().column("max_speed");
    const std::string unit = speed ? name_and_unit(timeline.table().names[*speed]).second : "";
    const std::string time = name_and_unit(timeline.table().names[*timeline.table().column("time")]).second;
    return Json::array(
        {timeline.chart("mesh size", axis_label("triangles", ""),
                        {{"raw_triangles", "extracted"}, {"simplified_triangles", "traced"}}),
         timeline.chart("flux error", axis_label("relative standard error", ""),
                        {{"relative_error", "largest of all species"}}),
         timeline.chart("time step", axis_label("time step", time), {{"dt", "time step"}}),
         timeline.chart("largest speed", axis_label("speed", unit), {{"max_speed", "largest speed"}})});
}

Json phases_section(const Json& timing) {
    Json rows = Json::array();
    double rest =
        timing.contains("total") && timing["total"].is_number() ? timing["total"].get<double>() : 0.0;
    for (const auto& [phase, seconds] : timing.items()) {
        if (phase == "total" || !seconds.is_number()) continue;
        rest -= seconds.get<double>();
        rows.push_back(Json::array({phase, seconds}));
    }
    rows.push_back(Json::array({"other", number_or_null(std::max(0.0, rest), 4)}));
    return Json{
        {"type", "bars"}, {"title", "Time by phase"}, {"unit", "s"}, {"names", {"seconds"}}, {"rows", rows}};
}

// Table rows: for each item its values at the fields, null where it has none.
template <class Fields>
Json rows_of(const Json& items, const Fields& fields) {
    Json rows = Json::array();
    for (const Json& item : items) {
        Json& row = rows.emplace_back(Json::array());
        for (const auto& field : fields) row.push_back(item.value(field, Json()));
    }
    return rows;
}

// Table of steps: duration asked for and taken, reason of the end, and measures at the end if there are any.
Json steps_section(const Json& summary, const Json& units, const std::string& time) {
    std::vector<std::string> columns{
        "step",     "model",     fmt::format("asked [{}]", time), fmt::format("took [{}]", time),
        "ended by", "time steps"};
    std::vector<Json::json_pointer> fields;
    for (const char* field :
         {"/name", "/model", "/asked_duration", "/duration", "/stopped_by", "/time_steps"})
        fields.emplace_back(field);
    if (std::ranges::any_of(summary["steps"], [](const Json& step) { return step.contains("endpoint"); })) {
        columns.insert(columns.end(),
                       {fmt::format("endpoint [{}]", time), fmt::format("over-etch [{}]", time)});
        fields.emplace_back("/endpoint/time");
        fields.emplace_back("/endpoint/over_etch");
    }
    std::set<std::string> names;
    for (const Json& step : summary["steps"]) {
        if (step.contains("bare") && names.insert("bare").second) {
            columns.emplace_back("bare share");
            fields.emplace_back("/bare");
        }
        const Json measures = step.value("measures", Json::object());
        for (const auto& [name, value] : measures.items())
            if (names.insert(name).second) {
                columns.push_back(with_unit(name, text_at(units, name)));
                fields.push_back(Json::json_pointer("/measures") / name);
            }
    }
    return plain_table("Steps", columns, rows_of(summary["steps"], fields));
}

void add_summary_tables(const Json& summary, Page& page) {
    Json rows = Json::array();
    const Json units = summary.value("metrology_units", Json::object());
    if (summary.contains("metrology"))
        for (const auto& [name, value] : summary["metrology"].items())
            rows.push_back(Json::array({name, value, shown_unit(text_at(units, name))}));
    page.sections.push_back(
        plain_table("Measures at the end", {"measure", "value", "unit"}, std::move(rows)));
    const std::string time = text_at(summary, "time_unit"),
                      volume = shown_unit(text_at(summary, "volume_unit"));
    const auto list = [&](const char* key, const std::string& title, const std::vector<std::string>& columns,
                          const std::vector<std::string>& names) {
        if (summary.contains(key) && !summary[key].empty())
            page.sections.push_back(plain_table(title, columns, rows_of(summary[key], names)));
    };
    if (summary.contains("steps") && !summary["steps"].empty())
        page.sections.push_back(steps_section(summary, units, time));
    list("events", "Events", {"what", fmt::format("time [{}]", time), "step", "material"},
         {"kind", "time", "name", "material"});
    list("flux", "Fluxes of the last time step",
         {"species", "method", "rays", "segments", "leaked", "relative error"},
         {"species", "method", "rays", "segments", "leaked", "relative_error"});
    if (!summary.contains("volumes") || summary["volumes"].empty()) return;
    Json volumes = Json::array();
    for (const auto& [name, v] : summary["volumes"].items())
        volumes.push_back(Json::array({name, v.at("net"), v.at("gross_added"), v.at("gross_removed")}));
    page.sections.push_back(
        plain_table("Volumes since the start",
                    {"material", fmt::format("net [{}]", volume), fmt::format("added [{}]", volume),
                     fmt::format("removed [{}]", volume)},
                    std::move(volumes)));
}

void add_facts(const Json& summary, Page& page) {
    const std::string length = shown_unit(text_at(summary, "length_unit")),
                      time = text_at(summary, "time_unit");
    page.fact("Recipe", text_at(summary, "recipe"));
    page.fact("Process time", fmt::format("{} {}", number_text(summary.value("time", Json())), time));
    page.fact("Time steps", number_text(summary.value("time_steps", Json()), 9));
    page.fact("Grid spacing",
              fmt::format("{} {}", number_text(summary.value("grid_spacing", Json())), length));
    if (summary.contains("timing"))
        page.fact("Run time",
                  fmt::format("{} s on {} threads", number_text(summary["timing"].value("total", Json()), 3),
                              number_text(summary.value("threads", Json()))));
    page.fact("Seed", number_text(summary.value("seed", Json()), 19));
    page.fact("Version", text_at(summary, "version"));
}

}  // namespace

Page run_page(const fs::path& folder, std::size_t bytes, const std::optional<SavedSurface>& only,
              bool later) {
    Page page{.kind = "run", .title = folder_name(folder), .notes{}};
    Json summary = Json::object();
    if (is_there(folder / "summary.json")) {
        summary = read_summary(folder);
        add_facts(summary, page);
    } else {
        const auto holder = lock_holder(folder);
        page.notes.push_back(
            holder
                ? fmt::format("This run is still under way ({}): the page shows its results so far.", *holder)
                : "This run has not ended: the page shows its results so far.");
    }
    if (is_there(folder / "surface.pvd")) {
        std::vector<ViewFrame> frames;
        std::vector<SavedSurface> saved_ones = only ? std::vector{*only} : saved_surfaces(folder);
        std::optional<Result> wafer;
        if (later) wafer = wafer_of_checkpoint(folder);
        if (wafer)
            saved_ones.front() = {.time = metadata_number(wafer->metadata, "time").value_or(0.0),
                                  .file = saved_ones.front().file};
        if (const SavedSurface& shown = saved_ones.front(); only)
            page.notes.push_back(
                shown.after.empty()
                    ? fmt::format("The view shows the wafer at time {:.6g} alone.", shown.time)
                    : fmt::format("The view shows the wafer at the end of step {} alone.", shown.after));
        surface::MeshMetadata metadata;
        surface::read_mesh(saved_ones.front().file, &metadata);
        const std::string unit = metadata_text(metadata, "time_unit", "");
        frames.reserve(saved_ones.size());
        for (SavedSurface& saved : saved_ones)
            frames.push_back({fmt::format("t = {:.6g} {}", saved.time, unit), folder, std::move(saved)});
        if (wafer) frames.front().wafer = std::make_shared<const Result>(*std::move(wafer));
        add_view(std::move(frames), folder / "recipe.toml", bytes, "", "Profiles over time", page);
    } else {
        page.notes.emplace_back("It has saved no surface yet.");
    }
    const Timeline timeline(folder / "timeline.csv", summary);
    if (!timeline.table().rows.empty()) {
        page.sections.push_back(charts_section("Measures over time", measure_charts(timeline)));
        page.sections.push_back(charts_section("Meshes, errors and time steps", numerics_charts(timeline)));
    }
    if (summary.contains("metrology")) add_summary_tables(summary, page);
    if (summary.contains("timing")) page.sections.push_back(phases_section(summary["timing"]));
    page.sections.push_back(recipe_section("Recipe", folder / "recipe.toml", text_at(summary, "recipe")));
    return page;
}

}  // namespace sidewall::app
