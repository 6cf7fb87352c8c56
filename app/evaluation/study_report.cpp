#include "app/evaluation/study_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "app/common/json.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kMean = "/original_to_simplified/mean";
constexpr const char* kTrace = "/trace/seconds/trace";

// Mean over the sets of what a method's rows have at a JSON pointer.
double mean(const Json& surface, const std::string& method, const char* pointer) {
    double sum = 0.0, count = 0.0;
    for (const Json& row : surface["rows"])
        if (row["method"] == method) sum += row.at(Json::json_pointer(pointer)).get<double>(), ++count;
    return sum / count;
}

std::string line(const std::vector<std::string>& cells) {
    return fmt::format("| {} |\n", fmt::join(cells, " | "));
}

std::string head(const std::vector<std::string>& cells) {
    return line(cells) + line(std::vector<std::string>(cells.size(), "---"));
}

// A claim of the chapter on a quantity against another method's, and the largest change that confirms it.
struct Claim {
    const char *quantity, *chapter, *pointer, *base;
    double at_most;
};

constexpr const char* kPlainName = "lindstrom-turk 0.5/0.5/0";
constexpr const char* kShapeName = "lindstrom-turk 0.4/0.3/0.3";
const Claim kClaims[] = {
    {"mean distance to the original", "-20 to -40 %", kMean, kShapeName, -0.2},
    {"mean distance to the original", "-20 to -40 %", kMean, kPlainName, -0.2},
    {"simplification time, features included", "+17 %", "/seconds/simplification", kPlainName, 0.17},
    {"tracing time", "-15 %, more in deep trenches", kTrace, "raw", -0.15},
    {"tracing time", "up to -12 % (deep)", kTrace, kShapeName, -0.05},  // less is within the noise
};

std::string verdicts(const Json& study) {
    std::vector<std::string> names{"claim", "chapter"};
    for (const Json& surface : study["surfaces"])
        names.push_back(fmt::format("surface {}", surface["surface"].get<int>()));
    names.emplace_back("verdict");
    std::string text = head(names);
    for (const Claim& claim : kClaims)
        for (const char* region : {"region", "region-bounded"}) {
            std::vector<std::string> cells{
                fmt::format("{}, {} against {}", claim.quantity, region, claim.base), claim.chapter};
            bool holds = true;
            for (const Json& surface : study["surfaces"]) {
                const double change =
                    mean(surface, region, claim.pointer) / mean(surface, claim.base, claim.pointer) - 1.0;
                cells.push_back(std::isfinite(change) ? fmt::format("{:+.0f} %", 100.0 * change) : "-");
                holds = holds && change <= claim.at_most;
            }
            cells.emplace_back(holds ? "holds" : "does not hold");
            text += line(cells);
        }
    return text +
           "\nMeans over all sets of vertices removed; negative is less. A claim holds if it does on every "
           "surface.\n\n";
}

// Seconds to the target at every depth, and the variant.
std::string way_text(const Json& way) {
    const std::string text = way["seconds"].is_null()
                                 ? fmt::format("not reached ({:.2g} %)", 100.0 * way["bias"].get<double>())
                                 : fmt::format("{:.3g}", way["seconds"].get<double>());
    return way["variant"] == "" ? text : fmt::format("{} ({})", text, way["variant"].get<std::string>());
}

// How many times as fast the fastest way with simplification is as the fastest without.
double gain(const Json& entry) {
    double raw = kInfinity, simplified = kInfinity;
    for (const Json& way : entry["ways"]) {
        double& least = way["way"].get<std::string>().starts_with("simplified") ? simplified : raw;
        if (!way["seconds"].is_null()) least = std::min(least, way["seconds"].get<double>());
    }
    return raw / simplified;
}

std::string five_ways_table(const Json& study) {
    const std::vector<std::string> names{"surface, sticking",
                                         "raw top-down",
                                         "raw top-down, smoothed",
                                         "simplified top-down",
                                         "raw radiosity",
                                         "simplified radiosity",
                                         "simplification pays, times as fast"};
    std::string rows;
    for (const Json& surface : study["surfaces"])
        for (const Json& entry : surface["five_ways"]) {
            std::vector<std::string> cells;
            for (const std::string& name : names)
                for (const Json& way : entry["ways"])
                    if (way["way"] == name && way["best"] == true) cells.push_back(way_text(way));
            rows += fmt::format("| {}, {:.3g} | {} | {:.2g} |\n", surface["surface"].get<int>(),
                                entry["sticking"].get<double>(), fmt::join(cells, " | "), gain(entry));
        }
    return fmt::format(
               "## Five ways to {:.3g} % at every depth\n\nCPU seconds end to end, from the raw mesh on, to that "
               "relative L2 error of the flux at its vertices in every tenth of the depth and on the floor, of the best "
               "variant of each way; in brackets what it is off by however many rays it has, and the variant.\n\n",
               100.0 * study["surfaces"][0]["five_ways"][0]["target"].get<double>()) +
           head(names) + rows;
}

}  // namespace

std::string study_report(const Json& study) {
    const bool hierarchical = std::ranges::any_of(
        study["surfaces"], [](const Json& surface) { return surface["grid"]["levels"].size() > 1; });
    return fmt::format(
               "# Region simplification on process surfaces\n\nThe evaluation of Lenz (2023), section 8.3, "
               "repeated on surfaces that Sidewall grew. They come from {}, and they carry the roughness of their own "
               "Monte Carlo fluxes. Methods at equal numbers of vertices; CPU seconds of all threads.\n\n",
               hierarchical ? "a grid of several levels, as the chapter's do"
                            : "a uniform grid where the chapter's come from a hierarchical one") +
           "## Verdicts\n\n" + verdicts(study) + five_ways_table(study);
}

std::string study_csv(const Json& study) {
    constexpr std::pair<const char*, const char*> kColumns[]{
        {"vertices", "/vertices"},
        {"triangles", "/triangles"},
        {"max_distance_dx", "/original_to_simplified/max"},
        {"mean_distance_dx", kMean},
        {"back_max_distance_dx", "/simplified_to_original/max"},
        {"back_mean_distance_dx", "/simplified_to_original/mean"},
        {"features_s", "/seconds/features"},
        {"collapse_s", "/seconds/collapse"},
        {"bvh_s", "/trace/seconds/bvh"},
        {"trace_s", kTrace}};
    std::string text = "surface,method,removal";
    for (const auto& column : kColumns) text += fmt::format(",{}", column.first);
    for (const Json& surface : study["surfaces"])
        for (const Json& row : surface["rows"]) {
            text += fmt::format("\n{},{},{}", surface["surface"].get<int>(), row["method"].get<std::string>(),
                                row["removal"].get<double>());
            for (const auto& [name, pointer] : kColumns) {
                const Json value = row.value(Json::json_pointer(pointer), Json());
                text += value.is_null() ? "," : fmt::format(",{:.9g}", value.get<double>());
            }
        }
    return text + "\n";
}

}  // namespace sidewall::app
