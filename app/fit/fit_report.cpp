#include "app/fit/fit_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/fit/fit_search.hpp"
#include "app/recipe/sections.hpp"
#include "app/schema/units.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

constexpr int kFitDigits = 6;
constexpr double kNoBound = 2.0;  // half an interval, in ranges: wider ones bound nothing

// The value at a place that may lie outside of the bounds, as an interval's end does.
double value_beyond(const Vary& vary, double place) {
    return vary.log ? vary.low * std::pow(vary.high / vary.low, place)
                    : vary.low + (vary.high - vary.low) * place;
}

// The unit of a key, in those of its recipe.
std::string unit_of(const std::vector<KeyDoc>& keys, const std::string& name, const Recipe& recipe) {
    const auto key = std::ranges::find(keys, name, &KeyDoc::name);
    if (key == keys.end()) return "";
    return unit_text(key->unit, recipe.domain.length_unit, recipe.domain.time_unit);
}

Json parameters_json(const FitEnd& end) {
    Json parameters = Json::object();
    const Recipe& recipe = end.recipes.front().best_recipe;
    const std::vector<KeyDoc> keys = settable_keys(recipe);
    for (std::size_t k = 0; k < end.varied.size(); ++k) {
        const Vary& vary = end.varied[k];
        const auto i = static_cast<Eigen::Index>(k);
        const double place = end.found.best[i], half = end.found.half_interval[i];
        Json json{{"value", std::stod(value_at(vary, place))}, {"unit", unit_of(keys, vary.key, recipe)}};
        constexpr double kAtBound = 1e-6;
        const bool at_bound = place < kAtBound || place > 1.0 - kAtBound;
        // At a bound the residuals are not least in this key, and the linear model gives no interval.
        const bool bounded = half < kNoBound && !at_bound;
        for (const double sign : {-1.0, 1.0})
            json["interval95"].push_back(
                bounded ? number_or_null(value_beyond(vary, place + sign * half), kFitDigits) : Json());
        if (at_bound) json["at_bound"] = place < 0.5 ? vary.low : vary.high;
        parameters[vary.key] = std::move(json);
    }
    return parameters;
}

Json correlation_json(const FitEnd& end) {
    constexpr int kFewDigits = 4;
    Json all = Json::object();
    const Eigen::MatrixXd& c = end.found.covariance;
    for (std::size_t a = 0; a < end.varied.size(); ++a)
        for (std::size_t b = 0; b < end.varied.size(); ++b) {
            const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
            const double value = i == j ? 1.0 : c(i, j) / std::sqrt(c(i, i) * c(j, j));
            all[end.varied[a].key][end.varied[b].key] = number_or_null(value, kFewDigits);
        }
    return all;
}

void add_residuals(const FittedRecipe& fitted, Json& all) {
    const std::string label = fitted.label.empty() ? "" : fitted.label + ":";
    const Json& metrology = fitted.best_run.summary["metrology"];
    const FitTargets& targets = fitted.targets;
    for (const MeasureTarget& target : targets.measures)
        all[label + target.name] = Json{{"asked", target.asked},
                                        {"got", metrology[target.name]},
                                        {"sigma", target.sigma ? Json(*target.sigma) : Json()},
                                        {"unit", fitted.best_run.summary["metrology_units"][target.name]}};
    for (std::size_t k = 0; k < targets.profiles.size(); ++k) {
        const auto found = profile_residual(targets, k, fitted.best_recipe, fitted.best_folder);
        if (!found) continue;
        const Eigen::VectorXd& d = found->distance.signed_distances;
        all[label + targets.profiles[k].name] =
            Json{{"asked", 0.0},  // distance, its root mean square
                 {"got", number_or_null(d.norm() / std::sqrt(static_cast<double>(d.size())), kFitDigits)},
                 {"sigma", targets.profile_sigma ? Json(*targets.profile_sigma) : Json()},
                 {"unit", fitted.best_recipe.domain.length_unit},
                 {"points", d.size()},
                 {"greatest", number_or_null(d.lpNorm<Eigen::Infinity>(), kFitDigits)},
                 {"offset",
                  {number_or_null(found->distance.offset.x(), kFitDigits),
                   number_or_null(found->distance.offset.y(), kFitDigits)}}};
    }
}

// Keys of every direction that the targets leave open.
Json free_keys(const FitEnd& end) {
    constexpr double kPart = 0.3;
    Json groups = Json::array();
    for (const Eigen::VectorXd& direction : end.found.free_directions) {
        Json keys = Json::array();
        for (std::size_t k = 0; k < end.varied.size(); ++k)
            if (std::abs(direction[static_cast<Eigen::Index>(k)]) >=
                kPart * direction.lpNorm<Eigen::Infinity>())
                keys.push_back(end.varied[k].key);
        groups.push_back(std::move(keys));
    }
    return groups;
}

// Rows of a contour's points between two places across the wafer, with an empty one where its line is broken.
std::string contour_rows(const char* name, const Contour& contour, double low, double high) {
    std::string rows;
    Eigen::Vector2d end(kInfinity, kInfinity);
    for (const auto& [a, b] : contour) {
        if (std::min(a.x(), b.x()) < low || std::max(a.x(), b.x()) > high) continue;
        if (a != end) rows += fmt::format("{0},,\n{0},{1:.7g},{2:.7g}\n", name, a.x(), a.y());
        rows += fmt::format("{},{:.7g},{:.7g}\n", name, b.x(), b.y());
        end = b;
    }
    return rows;
}

}  // namespace

Json fit_json(const FitEnd& end) {
    const LeastSquaresResult& found = end.found;
    const bool free = !found.free_directions.empty();
    Json json{{"status", free ? "not-identifiable" : found.converged ? "converged" : "max-runs"}};
    json["not_identifiable"] = free_keys(end);
    for (const FittedRecipe& fitted : end.recipes) {
        const std::string number = fmt::format("{:04}", fitted.best_number);
        if (fitted.label.empty())
            json["best_run"] = number;
        else
            json["best_runs"][fitted.label] = number;
    }
    json["parameters"] = parameters_json(end);
    json["correlation"] = correlation_json(end);
    json["residuals"] = Json::object();
    for (const FittedRecipe& fitted : end.recipes) add_residuals(fitted, json["residuals"]);
    json["errors_from"] = end.recipes.front().targets.known_errors ? "sigma"
                          : found.error_from_noise                 ? "simulation-noise"
                                                                   : "residuals";
    if (const ErrorCorrelation& errors = found.correlation; errors.shared > 0.0)
        json["profile_errors"] = Json{{"shared", errors.shared},
                                      {"length", number_or_null(errors.length, 3)},
                                      {"unit", end.recipes.front().best_recipe.domain.length_unit}};
    json["targets_met"] = meets_targets(found, end.recipes.front().targets.known_errors);
    json["misfit"] = number_or_null(misfit(found), 3);
    json["several_minima"] = end.several_minima;
    json["simulation_noise"] = number_or_null(found.noise, 3);
    return json;
}

std::string overlay_csv(const FittedRecipe& fitted, std::size_t profile) {
    const MeasuredProfile& measured = fitted.targets.profiles[profile];
    const auto best = profile_residual(fitted.targets, profile, fitted.best_recipe, fitted.best_folder);
    const Eigen::Vector2d offset = best ? best->distance.offset : Eigen::Vector2d::Zero();
    std::string csv =
        fmt::format("line,across the wafer [{0}],z [{0}]\n", fitted.best_recipe.domain.length_unit);
    for (const Eigen::Vector2d& p : measured.points)
        csv += csv_field("measured, " + measured.name) +
               fmt::format(",{:.7g},{:.7g}\n", p.x() + offset.x(), p.y() + offset.y());
    const Eigen::AlignedBox2d box = bounds_of(measured.points);
    const double margin = 0.2 * box.sizes().x(), low = box.min().x() + offset.x() - margin,
                 high = box.max().x() + offset.x() + margin;
    if (best) csv += contour_rows("best run", best->contour, low, high);
    if (std::filesystem::exists(fitted.first_folder / "summary.json"))
        csv += contour_rows("first run", contour_of(fitted.first_folder, fitted.best_recipe, measured.time),
                            low, high);
    return csv;
}

std::string unmet_targets(const Json& fit) {
    if (fit.value("targets_met", true) || fit.value("status", "") == "max-runs") return "";
    std::vector<std::string> at_bound;
    for (const auto& [key, parameter] : fit["parameters"].items())
        if (parameter.contains("at_bound")) at_bound.push_back(key);
    const double misfit = fit["misfit"].is_number() ? fit["misfit"].get<double>() : 0.0;
    const bool sigmas = fit["errors_from"] == "sigma";
    return fmt::format("the targets are not met within the bounds: the best run misses them by {:.3g}{}{}",
                       sigmas ? misfit : 100.0 * misfit, sigmas ? " sigmas" : " %",
                       at_bound.empty() ? "" : fmt::format("; at its bound: {}", fmt::join(at_bound, ", ")));
}

std::string fit_table(const Json& fit) {
    const auto text = [](const Json& value) {
        return value.is_number() ? fmt::format("{:.5g}", value.get<double>()) : std::string("unknown");
    };
    const auto unit = [](const Json& of) {
        const std::string name = of.contains("unit") && of["unit"].is_string() ? of["unit"] : "";
        return name.empty() ? name : " " + name;
    };
    const std::string status = fit["status"];
    const auto runs = fit["runs"].get<std::size_t>();
    std::string table = fmt::format("{} after {} run{}\n", status, runs, runs == 1 ? "" : "s");
    if (status == "max-runs")
        table +=
            "the runs did not suffice, these values are the best so far: go on with a greater --max-runs and "
            "--resume\n";
    if (const std::string unmet = unmet_targets(fit); !unmet.empty()) table += unmet + "\n";
    if (fit.value("several_minima", false))
        table += "there are several minima, of which this is the lowest found\n";
    for (const Json& keys : fit["not_identifiable"])
        table += fmt::format("the targets do not tell {}: {}\n",
                             fmt::join(keys.get<std::vector<std::string>>(), " from "),
                             keys.size() > 1 ? "only a combination of them; fix one, or add a target"
                                             : "it changes none of them");
    table += fmt::format("  {:<28} {:>12}   95 % interval\n", "key", "value");
    for (const auto& [key, parameter] : fit["parameters"].items())
        table += parameter.contains("at_bound")
                     ? fmt::format("  {:<28} {:>12}{}   -, at its bound\n", key, text(parameter["value"]),
                                   unit(parameter))
                     : fmt::format("  {:<28} {:>12}   {} to {}{}\n", key, text(parameter["value"]),
                                   text(parameter["interval95"][0]), text(parameter["interval95"][1]),
                                   unit(parameter));
    table += fmt::format("  {:<28} {:>12} {:>12} {:>12}\n", "target", "asked", "got", "sigma");
    for (const auto& [name, target] : fit["residuals"].items())
        table +=
            fmt::format("  {:<28} {:>12} {:>12} {:>12}{}\n", name, text(target["asked"]), text(target["got"]),
                        target["sigma"].is_null() ? "" : text(target["sigma"]), unit(target));
    return table;
}

}  // namespace sidewall::app
