#include "app/results/whole_summary.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/common/timing.hpp"
#include "app/common/version.hpp"
#include "app/results/result.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

bool is_number(const Json& json) {
    return json.is_number();
}
bool is_text(const Json& json) {
    return json.is_string();
}

using Is = bool (*)(const Json&);

bool has(const Json& json, const char* key, Is is) {
    return json.is_object() && json.contains(key) && is(json[key]);
}

// Absent ones are fine.
bool has_no_other(const Json& json, const char* key, Is is) {
    return !json.contains(key) || is(json[key]);
}

// A list of objects that all pass.
template <class Passes>
bool is_list(const Json& summary, const char* key, Passes&& passes) {
    if (!summary.contains(key) || !summary[key].is_array()) return false;
    return std::all_of(summary[key].begin(), summary[key].end(),
                       [&](const Json& one) { return one.is_object() && passes(one); });
}

bool has_timing(const Json& summary) {
    if (!summary.contains("timing")) return false;
    bool all = true;
    for_each_phase(
        [&](const char* name, double Timing::*) { all = all && has(summary["timing"], name, is_number); });
    return all;
}

// Figures that do not exist are null; each has its unit.
bool has_metrology(const Json& summary) {
    for (const char* key : {"metrology", "metrology_units"})
        if (!summary.contains(key) || !summary[key].is_object()) return false;
    const auto& figures = summary["metrology"].items();
    return std::all_of(figures.begin(), figures.end(), [&](const auto& figure) {
        return (figure.value().is_number() || figure.value().is_null()) &&
               has(summary["metrology_units"], figure.key().c_str(), is_text);
    });
}

// Bars of a run to an accuracy (accuracy/accuracy.hpp).
bool has_bars(const Json& summary) {
    if (!summary["accuracy"].is_object()) return false;
    for (const auto& [measure, bars] : summary["accuracy"].items()) {
        if (!has(bars, "status", is_text)) return false;
        for (const char* key : {"value", "total", "grid", "noise", "simplification"})
            if (!bars.contains(key)) return false;
        for (const char* key : {"reason", "asked_for"})
            if (!has_no_other(bars, key, is_text)) return false;
    }
    return summary.contains("accuracy_seconds") && has(summary["accuracy_seconds"], "total", is_number) &&
           has(summary["accuracy_seconds"], "settled", is_number) && summary.contains("accuracy_runs");
}

}  // namespace

std::optional<std::string> missing_in_summary(const Json& summary) {
    if (!summary.is_object()) return "an object";
    for (const char* key : {"version", "length_unit", "time_unit"})
        if (!has(summary, key, is_text)) return key;
    for (const char* key : {"grid_spacing", "time", "time_steps"})
        if (!has(summary, key, is_number)) return key;
    const bool events = is_list(summary, "events", [](const Json& event) {
        return has(event, "kind", is_text) && has_no_other(event, "material", is_text);
    });
    const bool steps =
        is_list(summary, "steps", [](const Json& step) { return has(step, "stopped_by", is_text); });
    if (!events) return "events";
    if (!steps) return "steps";
    if (!has_timing(summary)) return "timing";
    const Json mesh = summary.value("mesh", Json());
    for (const char* state : {"raw", "simplified"})
        for (const char* size : {"vertices", "triangles"})
            if (!mesh.is_object() || !has(mesh.value(state, Json()), size, is_number)) return "mesh";
    if (!has_metrology(summary)) return "metrology";
    if (summary.contains("accuracy") && !has_bars(summary)) return "accuracy";
    return std::nullopt;
}

bool has_other_version(const Json& summary) {
    return has(summary, "version", is_text) && summary["version"] != version();
}

std::optional<Json> own_summary(const std::filesystem::path& folder) {
    std::error_code failure;
    if (!std::filesystem::exists(folder / "summary.json", failure)) return std::nullopt;
    try {
        Json summary = read_summary(folder);
        if (missing_in_summary(summary) || has_other_version(summary)) return std::nullopt;
        return summary;
    } catch (const FileError&) {  // cut off
        return std::nullopt;
    }
}

Json read_whole_summary(const std::filesystem::path& folder) {
    Json summary = read_summary(folder);
    require_whole(summary, folder);
    return summary;
}

void require_whole(const Json& summary, const std::filesystem::path& folder) {
    if (const auto missing = missing_in_summary(summary))
        throw FileError(fmt::format("{}: is damaged: it lacks {} as a run writes it; {}",
                                    (folder / "summary.json").string(), *missing, kSummaryAdvice));
}

}  // namespace sidewall::app
