#include "app/sweep/run_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/common/text.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

std::string number_field(const Json& json) {
    return json.is_number() ? fmt::format(",{:.9g}", json.get<double>()) : ",";
}

std::string row_of(const std::vector<std::string>& columns, const RunPoint& point, const SetRun& run) {
    std::string row = fmt::format("{:04}", point.number);
    for (const std::string& value : point.values) row += fmt::format(",{}", csv_field(value));
    const auto field = [&](const char* part, const std::string& name) {
        row += number_field(run.summary.contains(part) ? run.summary[part].value(name, Json()) : Json());
    };
    for (const std::string& name : columns) field("metrology", name);
    field("timing", "total");
    return row + fmt::format(",{}\n", csv_field(run.status));
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
    const std::vector<std::string> names = figures_of(points, set);
    std::string table = "run";
    for (const auto* columns : {&keys, &names})
        for (const std::string& name : *columns) table += fmt::format(",{}", csv_field(name));
    table += ",seconds,status\n";
    for (const RunPoint& point : points) {
        const SetRun& run = set.runs[point.number - 1];
        if (run.ended) table += row_of(names, point, run);
    }
    return table;
}

std::optional<std::string> run_rows(const std::vector<std::string>& columns,
                                    const std::vector<RunPoint>& points, const RunSet& set,
                                    std::size_t number) {
    std::string rows;
    for (const RunPoint& point : points) {
        if (point.number != number) continue;
        for (const std::string& name : figures_of({point}, set))
            if (std::find(columns.begin(), columns.end(), name) == columns.end()) return std::nullopt;
        rows += row_of(columns, point, set.runs[number - 1]);
    }
    return rows;
}

std::vector<std::string> figures_of(const std::vector<RunPoint>& points, const RunSet& set) {
    std::vector<std::string> names;
    for (const RunPoint& point : points) {
        const SetRun& run = set.runs[point.number - 1];
        if (!run.summary.contains("metrology")) continue;
        for (const auto& [name, value] : run.summary["metrology"].items())
            if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    return names;
}

Json units_of(const RunSet& set) {
    Json units = Json::object();
    for (const SetRun& run : set.runs)
        if (run.summary.contains("metrology_units")) units.update(run.summary["metrology_units"]);
    return units;
}

}  // namespace sidewall::app
