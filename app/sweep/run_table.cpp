#include "app/sweep/run_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/common/text.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Figures of any run, those of the first one first.
std::vector<std::string> figures(const std::vector<RunPoint>& points, const RunSet& set) {
    std::vector<std::string> names;
    for (const RunPoint& point : points) {
        const SetRun& run = set.runs[point.number - 1];
        if (!run.summary.contains("metrology")) continue;
        for (const auto& [name, value] : run.summary["metrology"].items())
            if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    return names;
}

std::string number_field(const Json& json) {
    return json.is_number() ? fmt::format(",{:.9g}", json.get<double>()) : ",";
}

}  // namespace

Recipe recipe_at(const std::string& text, const std::string& file, const std::vector<std::string>& overrides,
                 const std::vector<std::string>& keys, const RunValues& values) {
    std::vector<std::string> settings = overrides;
    for (std::size_t k = 0; k < keys.size(); ++k) settings.push_back(keys[k] + "=" + values[k]);
    try {
        return parse_recipe(text, file, settings);
    } catch (const RecipeError& error) {
        const std::string message = error.what();
        for (std::size_t k = overrides.size(); k < settings.size(); ++k)
            if (const std::string set = "--set " + settings[k]; message.starts_with(set))
                throw RecipeError("--vary " + message.substr(std::string_view("--set ").size()));
        throw;
    }
}

Recipe recipe_changed(const std::string& effective, const std::string& file,
                      const std::vector<std::string>& overrides, std::vector<std::string> changes) {
    try {
        return parse_recipe(effective, file, changes);
    } catch (const RecipeError&) {
        changes.insert(changes.begin(), overrides.begin(), overrides.end());
        load_recipe(file, changes);
        throw;
    }
}

std::string run_table(const std::vector<std::string>& keys, const std::vector<RunPoint>& points,
                      const RunSet& set) {
    const std::vector<std::string> names = figures(points, set);
    std::string table = "run";
    for (const auto* columns : {&keys, &names})
        for (const std::string& name : *columns) table += fmt::format(",{}", csv_field(name));
    table += ",seconds,status\n";
    for (const RunPoint& point : points) {
        const SetRun& run = set.runs[point.number - 1];
        if (!run.ended) continue;
        table += fmt::format("{:04}", point.number);
        for (const std::string& value : point.values) table += fmt::format(",{}", csv_field(value));
        const Json& summary = run.summary;
        for (const std::string& name : names)
            table += number_field(summary.contains("metrology") ? summary["metrology"].value(name, Json())
                                                                : Json());
        table += number_field(summary.contains("timing") ? summary["timing"].value("total", Json()) : Json());
        table += fmt::format(",{}\n", csv_field(run.status));
    }
    return table;
}

Json units_of(const RunSet& set) {
    Json units = Json::object();
    for (const SetRun& run : set.runs)
        if (run.summary.contains("metrology_units")) units.update(run.summary["metrology_units"]);
    return units;
}

}  // namespace sidewall::app
