#include "app/fit/fit_report.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/fit/fit_errors.hpp"
#include "app/fit/fit_search.hpp"
#include "app/recipe/sections.hpp"
#include "app/schema/units.hpp"

namespace sidewall::app {
namespace {

constexpr int kFitDigits = 6;
constexpr double kNoBound = 2.0;  // largest half interval reported, in ranges of the key

// The value at a place that may lie outside of the bounds, as the end of an interval may.
double value_beyond(const Vary& vary, double place) {
    return vary.log ? vary.low * std::pow(vary.high / vary.low, place)
                    : vary.low + (vary.high - vary.low) * place;
}

// For each direction that the targets do not determine: the keys that change along it.
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

// \param free  from free_keys.
Json parameters_json(const FitEnd& end, const Json& free) {
    Json parameters = Json::object();
    const Recipe& best = end.recipes.front().best_recipe;
    const std::vector<KeyDoc> keys = settable_keys(best);
    for (std::size_t k = 0; k < end.varied.size(); ++k) {
        const Vary& vary = end.varied[k];
        const auto i = static_cast<Eigen::Index>(k);
        const double place = end.found.best[i], half = end.found.half_interval[i];
        Json json{{"value", std::stod(value_at(vary, place))}, {"unit", unit_of_key(keys, best, vary.key)}};
        constexpr double kAtBound = 1e-6;
        const bool at_bound = place < kAtBound || place > 1.0 - kAtBound;
        const bool is_free = std::ranges::any_of(
            free, [&](const Json& keys) { return std::ranges::find(keys, Json(vary.key)) != keys.end(); });
        // There is no interval at a bound, where the residuals are not least in this key, and none for keys
        // that the targets do not tell apart: the linear model does not hold over so wide an interval.
        const bool bounded = half < kNoBound && !at_bound && !is_free;
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

// \param first  index of the recipe's first residual; set to that of the next recipe.
void add_residuals(const FittedRecipe& fitted, const LeastSquaresResult& found, Eigen::Index& first,
                   Json& all) {
    constexpr int kFewDigits = 3;
    const std::string label = fitted.label.empty() ? "" : fitted.label + ":";
    const Json& metrology = fitted.best_run.summary["metrology"];
    const FitTargets& targets = fitted.targets;
    const Eigen::VectorXd noise = noise_over_seeds(found);
    for (const MeasureTarget& target : targets.measures) {
        Json& json = all[label + target.name] =
            Json{{"asked", target.asked},
                 {"got", metrology[target.name]},
                 {"sigma", target.sigma ? Json(*target.sigma) : Json()},
                 {"unit", fitted.best_run.summary["metrology_units"][target.name]}};
        const Eigen::Index i = first++;
        if (noise.size() > 0) json["noise"] = number_or_null(noise[i] * scale_of(target), kFewDigits);
        if (found.grid_steps.size() > 0 && found.grid_steps[i] > 0.0)
            json["grid_step"] = number_or_null(found.grid_steps[i] * scale_of(target), kFewDigits);
    }
    for (std::size_t k = 0; k < targets.profiles.size(); ++k) {
        const auto count = static_cast<Eigen::Index>(targets.profiles[k].points.size());
        const auto rms = [](const auto& d) { return d.norm() / std::sqrt(static_cast<double>(d.size())); };
        first += count;
        const auto best = profile_residual(targets, k, fitted.best_recipe, fitted.best_folder);
        if (!best) continue;
        const Eigen::VectorXd& d = best->distance.signed_distances;
        Json& json = all[label + targets.profiles[k].name] =
            Json{{"asked", 0.0},  // root mean square of the distances
                 {"got", number_or_null(rms(d), kFitDigits)},
                 {"sigma", targets.profile_sigma ? Json(*targets.profile_sigma) : Json()},
                 {"unit", fitted.best_recipe.domain.length_unit},
                 {"points", d.size()},
                 {"greatest", number_or_null(d.lpNorm<Eigen::Infinity>(), kFitDigits)},
                 {"offset",
                  {number_or_null(best->distance.offset.x(), kFitDigits),
                   number_or_null(best->distance.offset.y(), kFitDigits)}}};
        if (noise.size() > 0)
            json["noise"] = number_or_null(
                rms(noise.segment(first - count, count)) * profile_scale(targets, k), kFewDigits);
    }
}

// Rows of a contour's points between two places across the wafer; an empty row where a line ends.
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

// The unit of a key or target, to stand behind its value; none without a dimension.
std::string unit_behind(const Json& of) {
    const std::string unit = of.contains("unit") && of["unit"].is_string() ? of["unit"] : "";
    return unit.empty() || unit == "1" ? "" : " " + unit;
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

}  // namespace

std::string unit_of_key(const std::vector<KeyDoc>& keys, const Recipe& recipe, const std::string& name) {
    auto key = std::ranges::find(keys, name, &KeyDoc::name);
    if (key == keys.end())  // then the key follows a recipe's label
        key = std::ranges::find(keys, name.substr(name.find(':') + 1), &KeyDoc::name);
    return key == keys.end() ? "" : unit_text(key->unit, recipe.domain.length_unit, recipe.domain.time_unit);
}

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
    json["parameters"] = parameters_json(end, json["not_identifiable"]);
    json["correlation"] = correlation_json(end);
    json["residuals"] = Json::object();
    Eigen::Index first = 0;
    for (const FittedRecipe& fitted : end.recipes) add_residuals(fitted, found, first, json["residuals"]);
    json["noise_runs"] = found.repeats.cols();
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

std::vector<std::string> fit_remarks(const Json& fit) {
    std::vector<std::string> remarks;
    if (fit.value("status", "") == "max-runs")
        remarks.emplace_back(
            "the runs did not suffice, these values are the best so far: go on with a greater --max-runs and "
            "--resume");
    if (const std::string unmet = unmet_targets(fit); !unmet.empty()) remarks.push_back(unmet);
    if (fit.value("several_minima", false))
        remarks.emplace_back("there are several minima, of which this is the lowest found");
    for (const Json& keys : fit.value("not_identifiable", Json::array()))
        remarks.push_back(fmt::format("the targets do not tell {}: {}",
                                      fmt::join(keys.get<std::vector<std::string>>(), " from "),
                                      keys.size() > 1 ? "only a combination of them; fix one, or add a target"
                                                      : "it changes none of them by more than their errors"));
    for (const auto& [name, target] : fit.at("residuals").items())
        if (target.contains("grid_step"))
            remarks.push_back(fmt::format(
                "runs that should differ by up to {:.2g}{} have the same {} to the last digit: it goes by steps of the "
                "grid, and the intervals hold one; a finer grid_spacing or another target tells more",
                target["grid_step"], unit_behind(target), name));
    return remarks;
}

std::string noise_remark(const Json& fit) {
    const auto runs = fit.value("noise_runs", std::size_t{0});
    return runs < 2  // too few for a spread
               ? "the intervals lack the noise of the simulation: too few runs were left for other seeds"
               : fmt::format(
                     "the intervals hold the noise of the simulation, from {} more runs with other seeds at these values",
                     runs);
}

std::string fit_table(const Json& fit) {
    const auto text = [](const Json& value) {
        return value.is_number() ? fmt::format("{:.5g}", value.get<double>()) : std::string("unknown");
    };
    const auto runs = fit["runs"].get<std::size_t>();
    std::string table = fmt::format("{} after {} run{}\n", fit["status"], runs, runs == 1 ? "" : "s");
    for (const std::string& remark : fit_remarks(fit)) table += remark + "\n";
    table += noise_remark(fit) + "\n";
    table += fmt::format("  {:<28} {:>12}   95 % interval\n", "key", "value");
    for (const auto& [key, parameter] : fit["parameters"].items())
        table += parameter.contains("at_bound")
                     ? fmt::format("  {:<28} {:>12}{}   -, at its bound\n", key, text(parameter["value"]),
                                   unit_behind(parameter))
                     : fmt::format("  {:<28} {:>12}   {} to {}{}\n", key, text(parameter["value"]),
                                   text(parameter["interval95"][0]), text(parameter["interval95"][1]),
                                   unit_behind(parameter));
    const bool sigmas = fit["errors_from"] == "sigma";
    table += fmt::format("  {:<28} {:>12} {:>12} {:>12}{}\n", "target", "asked", "got", "noise",
                         sigmas ? fmt::format(" {:>12}", "sigma") : "");
    for (const auto& [name, target] : fit["residuals"].items())
        table +=
            fmt::format("  {:<28} {:>12} {:>12} {:>12}{}{}\n", name, text(target["asked"]),
                        text(target["got"]), text(target.value("noise", Json())),
                        sigmas ? fmt::format(" {:>12}", text(target["sigma"])) : "", unit_behind(target));
    return table;
}

}  // namespace sidewall::app
