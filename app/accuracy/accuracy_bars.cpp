#include "app/accuracy/accuracy_bars.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/common/text.hpp"
#include "app/fit/fit_errors.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/recipe_domain.hpp"

namespace sidewall::app {
namespace {

// Least bar of a length, in grid spacings: by so much flats on a node differ from flats between nodes.
constexpr double kLeastLength = 0.05;
constexpr int kValueDigits = 6, kBarDigits = 3;

// Events of the wafer and ends of its steps, sorted; without times and places, which vary with the grid.
std::vector<std::string> events_of(const Json& summary) {
    std::vector<std::string> all;
    for (const Json& event : summary["events"])
        all.push_back(
            fmt::format("{}{}", event["kind"],
                        event.contains("material") ? " " + event["material"].get<std::string>() : ""));
    for (const Json& step : summary["steps"]) all.push_back(fmt::format("end by {}", step["stopped_by"]));
    std::sort(all.begin(), all.end());
    return all;
}

// The first event that only one of two runs has; or "".
std::string differing_event(const AccuracyRun& one, const AccuracyRun& other) {
    const std::vector<std::string> a = events_of(one.summary), b = events_of(other.summary);
    std::vector<std::string> differing;
    std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(differing));
    return differing.empty() ? "" : differing.front();
}

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

double squares(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += std::pow(value - mean(values), 2);
    return sum;
}

AskedAccuracy read_one(const std::string& text) {
    constexpr const char* kForm = "write MEASURE=BOUND or MEASURE=PERCENT%, e.g. depth=0.02 or depth=1%";
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) throw RecipeError("--accuracy {}: {}", text, kForm);
    AskedAccuracy asked{.measure = text.substr(0, equals), .text = text.substr(equals + 1)};
    std::string_view bound = trimmed(asked.text);
    asked.relative = bound.ends_with('%');
    if (asked.relative) bound = trimmed(bound.substr(0, bound.size() - 1));
    const auto number = finite_number(bound);
    if (!number) throw RecipeError("--accuracy {}: {} is no number: {}", text, bound, kForm);
    if (!(*number > 0.0)) throw RecipeError("--accuracy {}: must be greater than 0", text);
    constexpr double kPercent = 0.01;
    asked.bound = asked.relative ? kPercent * *number : *number;
    if (asked.relative && asked.bound >= 1.0) throw RecipeError("--accuracy {}: must be below 100 %", text);
    return asked;
}

constexpr double kSafety = 1.25, kFewSafety = 3.0;   // Roache's safety factors for three grids and for two
constexpr double kLeastOrder = 0.3, kMostOrder = 1;  // bounds of the order seen

}  // namespace

AccuracyNoise noise_of(const AccuracyRun& on, const std::vector<AccuracyRun>& others) {
    AccuracyNoise noise{.on = on};
    for (const auto& [measure, value] : on.summary["metrology"].items()) {
        std::vector<double> as_it_is{on.figure(measure)}, raw;
        for (const AccuracyRun& run : others)
            (run.method == on.method ? as_it_is : raw).push_back(run.figure(measure));
        // If a run lacks the figure, the results are NaN, which counts as unknown.
        const auto degrees = static_cast<double>(as_it_is.size() - 1 + (raw.empty() ? 0 : raw.size() - 1));
        const double all = squares(as_it_is) + (raw.empty() ? 0.0 : squares(raw));
        noise.noise[measure] = degrees == 0.0 ? 0.0 : student_quantile(degrees) * std::sqrt(all / degrees);
        noise.simplification[measure] = raw.empty() ? 0.0 : std::abs(mean(raw) - mean(as_it_is));
    }
    return noise;
}

double noise_factor(const AccuracySettings& from, const AccuracySettings& to, bool flat) {
    const double cells = std::sqrt(from.spacing / to.spacing);
    if (from.relative_error) return *to.relative_error / *from.relative_error / cells;
    return std::sqrt(from.rays / to.rays) * (flat ? 1.0 : cells);
}

AccuracyBars bars_of(const std::string& measure, const Recipe& recipe, const std::vector<AccuracyRun>& grids,
                     const std::optional<AccuracyNoise>& noise, const AskedAccuracy* asked) {
    const AccuracyRun& last = grids.back();
    const bool flat = is_flat(recipe.domain);
    const auto figure_in = [&](const std::map<std::string, double>& figures) {
        const auto found = figures.find(measure);
        return found == figures.end() ? kInfinity : found->second;
    };
    const auto noise_on = [&](const AccuracyRun& run) {
        return noise ? figure_in(noise->noise) * noise_factor(noise->on, run, flat) : kInfinity;
    };
    AccuracyBars bars{.value = last.figure(measure), .noise = noise_on(last)};
    std::vector<GridValue> values;
    values.reserve(grids.size());
    for (const AccuracyRun& run : grids) values.push_back({run.spacing, run.figure(measure), noise_on(run)});
    const bool length = last.summary["metrology_units"].value(measure, "") == recipe.domain.length_unit;
    const GridError error = grid_error(values, length ? kLeastLength * last.spacing : 0.0);
    bars.grid = error.bar;
    bars.reason = error.reason;
    if (noise && last.method != "none") {
        const bool fixed = recipe.simplify.max_error || recipe.simplify.l_max || recipe.simplify.l0;
        bars.simplification =
            figure_in(noise->simplification) * (fixed ? 1.0 : last.spacing / noise->on.spacing);
    }
    if (asked != nullptr) bars.asked = asked->bound * (asked->relative ? std::abs(bars.value) : 1.0);

    bars.known = std::isfinite(bars.value) && std::isfinite(bars.total());
    if (!bars.known && bars.reason.empty()) bars.reason = "some of the runs do not have it";
    if (grids.size() > 1)
        if (const std::string event = differing_event(grids[grids.size() - 2], last); !event.empty()) {
            bars.known = false;
            bars.reason = fmt::format("events differ between the two finest grids: {}", event);
        }
    if (bars.known && asked != nullptr && asked->relative && std::abs(bars.value) <= bars.total()) {
        bars.known = false;
        bars.reason = "its bars reach 0, of which there is no part: ask for an absolute accuracy";
    }
    // If differences do not fall, a bar counts only if it is small enough all the same.
    if (bars.known && error.reason.find("do not fall") != std::string::npos && asked != nullptr &&
        !bars.reached())
        bars.known = false;
    return bars;
}

Json bars_json(const AccuracyBars& bars, const AskedAccuracy* asked) {
    Json json{{"value", number_or_null(bars.value, kValueDigits)},
              {"grid", number_or_null(bars.grid, kBarDigits)},
              {"noise", number_or_null(bars.noise, kBarDigits)},
              {"simplification", number_or_null(bars.simplification, kBarDigits)},
              {"total", bars.known ? number_or_null(bars.total(), kBarDigits) : Json()},
              {"asked", asked == nullptr ? Json() : number_or_null(bars.asked, kValueDigits)},
              {"status", !bars.known        ? "unknown"
                         : asked == nullptr ? "known"
                         : bars.reached()   ? "reached"
                                            : "not-reached"}};
    if (!bars.reason.empty()) json["reason"] = bars.reason;
    if (asked != nullptr) json["asked_for"] = asked->text;
    return json;
}

Json run_json(const AccuracyRun& run) {
    Json json{{"folder", run.folder.empty() ? "." : run.folder},
              {"grid_spacing", run.spacing},
              {"simplify", run.method},
              {"seed", run.seed},
              {"seconds", number_or_null(run.seconds(), kBarDigits)}};
    if (run.relative_error)
        json["relative_error"] = *run.relative_error;
    else
        json["rays"] = run.rays;
    return json;
}

std::string accuracy_table(const Json& summary) {
    const auto text = [](const Json& number) {
        return number.is_number() ? fmt::format("{:.2g}", number.get<double>()) : std::string("unknown");
    };
    constexpr const char* kRow = "  {:<20} {:>10} {:<6} {:>9} {:>9} {:>9} {:>14} {:>8}{}\n";
    std::string table =
        fmt::format(kRow, "measure", "value", "", "+-", "grid", "noise", "simplification", "asked", "");
    for (const auto& [measure, bars] : summary["accuracy"].items()) {
        const std::string status = bars["status"], reason = bars.value("reason", "");
        table += fmt::format(
            kRow, measure, bars["value"].is_number() ? fmt::format("{:.5g}", bars["value"]) : "none",
            summary["metrology_units"].value(measure, ""), text(bars["total"]), text(bars["grid"]),
            text(bars["noise"]), text(bars["simplification"]), bars.value("asked_for", ""),
            (status == "known" || status == "unknown" ? "" : "  " + status) +
                (reason.empty() ? "" : "  (" + reason + ")"));
    }
    const Json& seconds = summary["accuracy_seconds"];
    return table +
           fmt::format("  grid spacing {:.4g} {}; {} runs took {:.3g} s, {:.2g} times the one settled on\n",
                       summary["grid_spacing"], summary["length_unit"], summary["accuracy_runs"].size(),
                       seconds["total"], seconds["total"].get<double>() / seconds["settled"].get<double>());
}

std::vector<AskedAccuracy> read_accuracy(const std::vector<std::string>& texts, Recipe& recipe) {
    std::vector<AskedAccuracy> all;
    for (const std::string& text : texts) {
        AskedAccuracy asked = read_one(text);
        want_figure(recipe, asked.measure, "--accuracy", text);
        for (const AskedAccuracy& other : all)
            if (other.measure == asked.measure)
                throw RecipeError("--accuracy {}: {} is asked for twice", text, asked.measure);
        all.push_back(std::move(asked));
    }
    return all;
}

GridError grid_error(const std::vector<GridValue>& grids, double least) {
    std::size_t count = 0;  // of the finest grids in a row that have it
    while (count < std::min<std::size_t>(3, grids.size()) &&
           std::isfinite(grids[grids.size() - 1 - count].value))
        ++count;
    if (count == 0) return {kInfinity, "the finest grid does not have it"};
    if (count == 1) return {kInfinity, "only one grid has it"};
    const GridValue &fine = grids[grids.size() - 1], &middle = grids[grids.size() - 2];
    const double ratio = middle.spacing / fine.spacing, last = middle.value - fine.value;
    const double near = std::abs(last) / (ratio - 1.0);  // the error at order 1
    if (count == 2)
        return {std::max(least, kFewSafety * near),
                fmt::format("only two grids have it: their difference counts {:g} times", kFewSafety)};

    const GridValue& coarse = grids[grids.size() - 3];
    const double before = coarse.value - middle.value,
                 on_middle = std::abs(before) / (coarse.spacing / middle.spacing - 1.0),
                 far = on_middle / (ratio * ratio);
    if (last * before < 0.0) {
        const double enclosed = std::max(std::abs(last), std::abs(before) / ratio);
        return {std::max(least, kSafety * enclosed), ""};
    }
    constexpr double kFalling = 0.8;  // order 0.3 on grids of ratio 2
    const bool hidden = std::abs(last) <= std::max(least, fine.noise + middle.noise);
    if (near > kFalling * on_middle && !hidden)
        return {std::max(least, kFewSafety * near), "differences between grids do not fall yet"};
    const double order =
        near > 0.0 ? std::clamp(std::log(on_middle / near) / std::log(ratio), kLeastOrder, kMostOrder)
                   : kMostOrder;
    return {std::max({least, kSafety * std::abs(last) / (std::pow(ratio, order) - 1.0), kSafety * far}), ""};
}

}  // namespace sidewall::app
