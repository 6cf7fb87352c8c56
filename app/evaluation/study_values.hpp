#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "app/common/json.hpp"

// What report, table and figures read from study.json: of a row, one method at one removal, or of a surface.
// Seconds and grid spacings.
namespace sidewall::app::study_values {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
using RowValue = std::function<double(const Json&)>;  ///< of a row

/// The number under some keys, or kUnknown.
inline double at(const Json& row, std::initializer_list<const char*> keys) {
    const Json* json = &row;
    for (const char* key : keys) {
        if (!json->is_object() || !json->contains(key)) return kUnknown;
        json = &(*json)[key];
    }
    return json->is_number() ? json->get<double>() : kUnknown;
}

inline double mean_distance(const Json& row) {
    return at(row, {"original_to_simplified", "mean"});
}
inline double max_distance(const Json& row) {
    return at(row, {"original_to_simplified", "max"});
}
inline double collapse(const Json& row) {
    return at(row, {"seconds", "collapse"});
}
inline double simplification(const Json& row) {
    return at(row, {"seconds", "features"}) + collapse(row);
}
inline double trace(const Json& row) {
    return at(row, {"trace", "seconds", "trace"});
}
inline double bvh(const Json& row) {
    return at(row, {"trace", "seconds", "bvh"});
}
inline double error(const Json& row) {
    return at(row, {"trace", "flux_error", "error"});
}
inline double bias(const Json& row) {
    return at(row, {"trace", "flux_error", "bias"});
}
inline double end_to_end(const Json& row) {
    return simplification(row) + bvh(row) + trace(row);
}
/// Seconds from the raw mesh to a flux of the target error.
inline double to_error(const Json& row) {
    return simplification(row) + bvh(row) + at(row, {"trace", "flux_error", "seconds_to_error"});
}

/// In the order of the rows.
inline std::vector<std::string> methods_of(const Json& surface) {
    std::vector<std::string> names;
    for (const Json& row : surface["rows"])
        if (std::find(names.begin(), names.end(), row["method"]) == names.end())
            names.push_back(row["method"]);
    return names;
}

inline std::vector<double> removals_of(const Json& surface) {
    std::set<double> removals;
    for (const Json& row : surface["rows"]) removals.insert(row["removal"].get<double>());
    return {removals.begin(), removals.end()};
}

/// Or nullptr.
inline const Json* find_row(const Json& surface, const std::string& method, double removal) {
    for (const Json& row : surface["rows"])
        if (row["method"] == method && row["removal"] == removal) return &row;
    return nullptr;
}

/// Mean of a value over the sets that every one of the methods has.
inline double mean_over_sets(const Json& surface, const std::string& method, const RowValue& value) {
    double sum = 0.0, count = 0.0;
    for (const Json& row : surface["rows"])
        if (row["method"] == method && std::isfinite(value(row))) sum += value(row), ++count;
    return count > 0.0 ? sum / count : kUnknown;
}

inline double raw_trace(const Json& surface) {
    return at(surface["raw"], {"seconds", "trace"});
}
/// The raw mesh's mean seconds, taken in turns with the sets' own where the study has them.
inline double raw_trace_in_turns(const Json& surface) {
    double sum = 0.0, count = 0.0;
    for (const Json& row : surface["rows"])
        if (const double raw = at(row, {"trace", "seconds", "raw"}); std::isfinite(raw)) sum += raw, ++count;
    return count > 0.0 ? sum / count : raw_trace(surface);
}
inline double raw_bvh(const Json& surface) {
    return at(surface["raw"], {"seconds", "bvh"});
}

/// Methods whose meshes were traced.
inline std::vector<std::string> traced(const Json& surface) {
    std::vector<std::string> names = methods_of(surface);
    std::erase_if(names, [&](const std::string& name) {
        return !find_row(surface, name, removals_of(surface).front())->contains("trace");
    });
    return names;
}

}  // namespace sidewall::app::study_values
