#include "app/study/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/common/files.hpp"
#include "app/common/folder_lock.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/common/version.hpp"
#include "app/recipe/written_number.hpp"
#include "app/study/batch_folder.hpp"
#include "app/study/fit_report.hpp"
#include "app/study/run_table.hpp"
#include "app/study/sobol.hpp"
#include "surface/error.hpp"
#include "surface/file.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kFile = "fit.json";

// A fit under way.
struct Fit {
    const FitOptions& options;
    std::string text;  // of the recipe
    std::vector<Vary> varied;
    std::vector<std::string> keys;
    FitTargets targets;
    BoxPoint start;
    RunSet set;
    std::vector<RunPoint> points;  // in the order they were asked for
    std::vector<Recipe> recipes;   // of the points
    std::string missing;           // a target that a run lacks, or why one failed
};

void require_ranges(const std::vector<Vary>& varied) {
    if (varied.empty())
        throw RecipeError("--vary: missing: name a key and its bounds, e.g. step[0].sticking=0.01:1:log");
    if (varied.size() > kSobolDimensions)
        throw RecipeError(fmt::format("--vary: a fit varies at most {} keys", kSobolDimensions));
    for (const Vary& vary : varied) {
        if (!vary.is_range() || vary.count)
            throw RecipeError(
                fmt::format("--vary {}: a fit needs bounds alone: {}=LOW:HIGH or {}=LOW:HIGH:log", vary.key,
                            vary.key, vary.key));
        if (vary.whole)
            throw RecipeError(fmt::format(
                "--vary {}: holds whole numbers, among which a fit cannot go downhill: use sidewall sweep",
                vary.key));
    }
}

RunValues values_of(const Fit& fit, const BoxPoint& point) {
    RunValues values;
    values.reserve(fit.varied.size());
    for (std::size_t k = 0; k < fit.varied.size(); ++k)
        values.push_back(value_at(fit.varied[k], point[static_cast<Eigen::Index>(k)]));
    return values;
}

Recipe recipe_of(const Fit& fit, const BoxPoint& point) {
    Recipe recipe =
        recipe_at(fit.text, fit.options.recipe, fit.options.overrides, fit.keys, values_of(fit, point));
    want_targets(fit.targets, recipe);
    return recipe;
}

// All that can be refused is refused here, before anything runs.
Fit read_fit(const FitOptions& options) {
    const Recipe base = load_recipe(options.recipe, options.overrides);
    Fit fit{.options = options, .text = surface::read_whole_file(options.recipe)};
    fit.varied = parse_vary(options.vary, base);
    require_ranges(fit.varied);
    fit.targets = read_targets(options, base);
    fit.start = BoxPoint::Constant(static_cast<Eigen::Index>(fit.varied.size()), 0.5);
    for (std::size_t k = 0; k < fit.varied.size(); ++k) {
        fit.keys.push_back(fit.varied[k].key);
        const auto now = written_number(fit.text, options.recipe, options.overrides, fit.keys.back());
        if (now && *now >= fit.varied[k].low && *now <= fit.varied[k].high)
            fit.start[static_cast<Eigen::Index>(k)] = place_of(fit.varied[k], *now);
    }
    // Rules of one key bound a range at its ends, with the other keys somewhere between theirs.
    recipe_of(fit, fit.start);
    for (Eigen::Index k = 0; k < fit.start.size(); ++k)
        for (const double end : {0.0, 1.0}) {
            BoxPoint point = fit.start;
            point[k] = end;
            recipe_of(fit, point);
        }
    fit.set = {.folder = options.output, .jobs = options.jobs, .resume_command = options.resume_command};
    return fit;
}

Json plan_of(const Fit& fit) {
    const FitOptions& options = fit.options;
    std::string profiles;
    for (const MeasuredProfile& profile : fit.targets.profiles)
        for (const Eigen::Vector2d& p : profile.points) profiles += fmt::format("{},{} ", p.x(), p.y());
    const std::string first = effective_recipe(recipe_of(fit, fit.start));
    return Json{
        {"version", version()},
        {"recipe", options.recipe},
        {"vary", options.vary},
        {"set", options.overrides},
        {"target", options.targets},
        {"target_profile", options.profiles},
        {"profile_sigma", options.profile_sigma ? Json(*options.profile_sigma) : Json()},
        {"profile_offset", options.profile_offset},
        {"digest", digest(fmt::format("{} {} {} {}", version(), first, profiles,
                                      Json{options.vary, options.targets, options.profiles,
                                           options.profile_offset, options.profile_sigma.value_or(0.0)}
                                          .dump()))}};
}

// The point's run, of several points that are asked for at once; nothing where values that are each right do
// not fit together.
std::optional<std::size_t> add_point(Fit& fit, const BoxPoint& point) {
    try {
        Recipe recipe = recipe_of(fit, point);
        fit.points.push_back({values_of(fit, point), add_run(fit.set, recipe)});
        fit.recipes.push_back(std::move(recipe));
        return fit.points.size() - 1;
    } catch (const RecipeError& error) {
        fit.missing = error.what();
        return std::nullopt;
    }
}

Residuals residuals_at(Fit& fit, std::size_t point) {
    const std::size_t number = fit.points[point].number;
    const SetRun& run = fit.set.runs[number - 1];
    std::string missing;
    Residuals residuals;
    if (run.status == "ok")
        residuals = residuals_of(fit.targets, fit.recipes[point], run, folder_of(fit.set, number), missing);
    if (!residuals)
        fit.missing = run.status != "ok" ? run.status : fmt::format("run {:04} has no {}", number, missing);
    return residuals;
}

std::vector<Residuals> evaluate(Fit& fit, ProgressBar& progress, const std::vector<BoxPoint>& points) {
    std::vector<std::optional<std::size_t>> added;
    std::vector<std::size_t> numbers;
    for (const BoxPoint& point : points) {
        added.push_back(add_point(fit, point));
        if (added.back()) numbers.push_back(fit.points[*added.back()].number);
    }
    make_runs(fit.set, numbers, progress,
              [&] { write_file(fit.options.output / "fit.csv", run_table(fit.keys, fit.points, fit.set)); });
    std::vector<Residuals> residuals;
    residuals.reserve(added.size());
    for (const auto& point : added) residuals.push_back(point ? residuals_at(fit, *point) : std::nullopt);
    return residuals;
}

LeastSquaresResult find(Fit& fit) {
    const FitOptions& options = fit.options;
    ProgressBar progress("fit", static_cast<double>(options.max_runs), "runs at most", !options.quiet,
                         {.tenths = true});
    try {
        return fit_least_squares(
            {.start = fit.start,
             .evaluate = [&](const std::vector<BoxPoint>& points) { return evaluate(fit, progress, points); },
             .max_runs = options.max_runs,
             .known_errors = fit.targets.known_errors});
    } catch (const NumericsError& error) {
        throw NumericsError(fmt::format("{}: {}: {}", options.recipe, error.what(), fit.missing));
    }
}

}  // namespace

Json run_fit(const FitOptions& options) {
    if (options.max_runs < 1 || options.max_runs > kMostRuns)
        throw RecipeError(fmt::format("--max-runs {}: must be from 1 to {}", options.max_runs, kMostRuns));
    Fit fit = read_fit(options);
    make_folder(options.output, "choose another with -o");
    const FolderLock lock(options.output);
    Json json = plan_of(fit);
    open_batch_folder(options.output, kFile, "fit", json, options.resume);
    const std::string path = (options.output / kFile).string();
    adopt_runs(fit.set);
    json["status"] = "unfinished";
    // A result stands until there is a better one.
    if (!std::filesystem::exists(path)) write_json(path, json);

    const LeastSquaresResult found = find(fit);
    const RunValues best_values = values_of(fit, found.best);
    const auto best = std::find_if(fit.points.begin(), fit.points.end(),
                                   [&](const RunPoint& point) { return point.values == best_values; });
    const Recipe& recipe = fit.recipes[static_cast<std::size_t>(best - fit.points.begin())];
    const SetRun& run = fit.set.runs[best->number - 1];
    const FitEnd end{.varied = fit.varied,
                     .targets = fit.targets,
                     .found = found,
                     .best_recipe = recipe,
                     .best_run = run,
                     .best_number = best->number,
                     .best_folder = folder_of(fit.set, best->number),
                     .first_folder = folder_of(fit.set, fit.points.front().number)};
    write_file(options.output / "best.toml", run.recipe);
    json.update(fit_json(end));
    std::set<std::size_t> numbers;  // equal points share a run
    for (const RunPoint& point : fit.points) numbers.insert(point.number);
    json["runs"] = numbers.size();
    write_json(path, json);
    for (std::size_t k = 0; k < fit.targets.profiles.size(); ++k)
        write_file(
            options.output / (k == 0 ? std::string("overlay.svg") : fmt::format("overlay_{}.svg", k + 1)),
            overlay_svg(end, k));
    return json;
}

}  // namespace sidewall::app
