#include <fmt/format.h>

#include <cstdlib>
#include <map>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/report/parts.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// A line a method of what its rows have at a JSON pointer; nothing for rows that lack it.
Json over_removal(const Json& surface, const char* title, const char* y, const char* pointer) {
    Json chart{{"title", title},
               {"x", "vertices removed [%]"},
               {"y", y},
               {"log_y", true},
               {"series", Json::array()}};
    std::map<std::string, Json> lines;
    for (const Json& row : surface.at("rows")) {
        Json& points = lines[row.at("method").get<std::string>()];
        points.push_back(
            {100.0 * row.at("removal").get<double>(), row.value(Json::json_pointer(pointer), Json())});
    }
    for (auto& [method, points] : lines)
        chart["series"].push_back({{"name", method}, {"marked", true}, {"points", std::move(points)}});
    return chart;
}

// The share of vertices farther from the simplified mesh than a distance, at the largest share of vertices
// removed.
Json distance_charts(const Json& surface) {
    Json chart{{"title", "Distances at the largest removal"},
               {"x", "distance d [dx]"},
               {"y", "share of vertices farther than d [1]"},
               {"log_x", true},
               {"log_y", true},
               {"series", Json::array()}};
    const Json& rows = surface.at("rows");
    for (const Json& row : rows)
        if (row.at("removal") == rows.back().at("removal"))
            chart["series"].push_back({{"name", row.at("method")}, {"points", row.at("exceedance")}});
    return chart;
}

Json five_ways_chart(const Json& entry) {
    Json chart{
        {"title", fmt::format("Time to {:.3g} % flux error, sticking {:.3g}",
                              100.0 * entry.at("target").get<double>(), entry.at("sticking").get<double>())},
        {"x", "depth [%], floor at 105"},
        {"y", "CPU time [s]"},
        {"log_y", true},
        {"series", Json::array()}};
    for (const Json& way : entry.at("ways")) {
        if (way.at("best") != true) continue;
        Json points = Json::array();
        for (const Json& depth : way.at("by_depth")) {
            const auto name = depth.at("depth").get<std::string>();
            points.push_back({name == "floor" ? 105.0 : std::atof(name.c_str()) + 5.0, depth.at("seconds")});
        }
        chart["series"].push_back({{"name", way.at("way")}, {"marked", true}, {"points", std::move(points)}});
    }
    return chart;
}

}  // namespace

Page study_page(const fs::path& folder, std::size_t /*bytes*/) {
    Page page("study", folder_name(folder));
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
        Json charts = Json::array(
            {over_removal(surface, "Mean distance to the original", "distance [dx]",
                          "/original_to_simplified/mean"),
             over_removal(surface, "Largest distance to the original", "distance [dx]",
                          "/original_to_simplified/max"),
             distance_charts(surface),
             over_removal(surface, "Simplification time", "CPU time [s]", "/seconds/simplification"),
             over_removal(surface, "Tracing time", "CPU time [s]", "/trace/seconds/trace")});
        for (const Json& entry : surface.value("five_ways", Json::array()))
            charts.push_back(five_ways_chart(entry));
        page.sections.push_back(
            charts_section(fmt::format("Surface {}", surface.at("surface").get<int>()), std::move(charts)));
    }
    if (is_there(folder / "study.csv"))
        page.sections.push_back(
            table_section("All rows", read_text_table(folder / "study.csv"), Json::object()));
    return page;
}

}  // namespace sidewall::app
