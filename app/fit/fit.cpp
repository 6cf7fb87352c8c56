#include "app/fit/fit.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <set>

#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/common/version.hpp"
#include "app/fit/fit_report.hpp"
#include "app/fit/fit_search.hpp"
#include "app/fit/fit_targets.hpp"
#include "app/process/state.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/node_path.hpp"
#include "app/schema/keys.hpp"
#include "app/schema/units.hpp"
#include "app/sweep/run_set.hpp"
#include "app/sweep/sweep.hpp"
#include "app/sweep/vary.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kFile = "fit.json";

struct FitRecipe {
    std::string label;      // empty if it is the only one
    const FitOptions& all;  // options of the fit, as the user wrote them
    FitOptions options;     // those for this recipe, its label removed
    std::string text;       // content of the file
    std::string length_unit;
    FitTargets targets;
    std::vector<std::string> keys;     // keys that it varies
    std::vector<std::size_t> places;   // their indices in Fit::varied
    std::vector<Recipe> recipes;       // one a point
    std::vector<std::size_t> numbers;  // run numbers of these
};

struct Fit {
    const FitOptions& options;
    std::vector<FitRecipe> parts;
    std::vector<Vary> varied;
    std::vector<std::string> columns;  // of fit.csv
    BoxPoint start;
    RunSet set;
    std::vector<RunValues> points;  // in the order they were asked for
    std::vector<RunPoint> rows;     // of fit.csv
    std::string missing;            // the last target that a run lacked, or why one failed
};

void require_ranges(const std::vector<Vary>& varied) {
    if (varied.empty())
        throw RecipeError("--vary: missing: name a key and its bounds, e.g. step[0].sticking=0.01:1:log");
    if (varied.size() > kSobolDimensions)
        throw RecipeError("--vary: a fit varies at most {} keys", kSobolDimensions);
    for (const Vary& vary : varied) {
        if (vary.words || vary.whole)
            throw RecipeError("--vary {}: holds {}, among which a fit cannot go downhill: use sidewall sweep",
                              vary.key, vary.words ? "one of several words" : "whole numbers");
        if (!vary.is_range() || vary.count)
            throw RecipeError("--vary {}: a fit needs bounds alone: {}=LOW:HIGH or {}=LOW:HIGH:log", vary.key,
                              vary.key, vary.key);
    }
}

// An error message about one recipe in which targets, keys and settings have the label that the user wrote
// before them. A message about something that all recipes share gets the label in front.
std::string with_label(const std::string& message, const std::string& label, const FitOptions& options) {
    if (label.empty()) return message;
    for (const auto& [option, texts] :
         {std::pair("--target-profile", &options.profiles), std::pair("--target", &options.targets),
          std::pair("--vary", &options.vary), std::pair("--set", &options.overrides)}) {
        const std::string start = std::string(option) + " ", missing = std::string(option) + ": missing";
        if (message.starts_with(missing))
            return fmt::format("{} for {}{}", missing, label, message.substr(missing.size()));
        if (!message.starts_with(start)) continue;
        const std::string rest = message.substr(start.size());
        const std::string name = rest.substr(0, rest.find_first_of("=@: "));
        for (const std::string& text : *texts)
            if (text.starts_with(fmt::format("{}:{}", label, name)))
                return fmt::format("{}{}:{}", start, label, rest);
    }
    return message.starts_with("--") ? label + ": " + message : message;
}

auto about_recipe(const std::string& label, const FitOptions& options, const auto& read) {
    try {
        return read();
    } catch (const RecipeError& error) {
        throw RecipeError(with_label(error.what(), label, options));
    }
}

RunValues values_of(const Fit& fit, const BoxPoint& point) {
    RunValues values;
    values.reserve(fit.varied.size());
    for (std::size_t k = 0; k < fit.varied.size(); ++k)
        values.push_back(value_at(fit.varied[k], point[static_cast<Eigen::Index>(k)]));
    return values;
}

Recipe recipe_of(const FitRecipe& part, const RunValues& values) {
    RunValues own_values;
    for (const std::size_t place : part.places) own_values.push_back(values[place]);
    return about_recipe(part.label, part.all, [&] {
        Recipe recipe =
            recipe_at(part.text, part.options.recipes[0], part.options.overrides, part.keys, own_values);
        want_targets(part.targets, recipe);
        return recipe;
    });
}

void check_point(const Fit& fit, const BoxPoint& point) {
    for (const FitRecipe& part : fit.parts) recipe_of(part, values_of(fit, point));
}

// The place of a key's value in the recipe, if it lies between the bounds.
std::optional<double> start_of(const FitRecipe& part, const Vary& vary, const std::string& key) {
    const auto now = written_number(part.text, part.options.recipes[0], part.options.overrides, key);
    if (!now || *now < vary.low || *now > vary.high) return std::nullopt;
    return place_of(vary, *now);
}

// Reads the targets and ranges of recipe number r; adds its keys to those of the fit, \p all.
FitRecipe read_part(const FitOptions& options, const std::vector<std::string>& labels, std::size_t r,
                    std::vector<Vary>& all) {
    FitRecipe part{.label = labels[r], .all = options, .options = options};
    part.options.recipes = {options.recipes[r]};
    for (const auto texts :
         {&FitOptions::overrides, &FitOptions::vary, &FitOptions::targets, &FitOptions::profiles})
        part.options.*texts = own_texts(options.*texts, labels, labels[r]);
    const Recipe base = load_recipe(options.recipes[r], part.options.overrides);
    part.text = surface::read_whole_file(options.recipes[r]);
    part.length_unit = base.domain.length_unit;
    part.targets = read_targets(part.options, base);
    const std::vector<Vary> varied = parse_vary(part.options.vary, base);
    require_ranges(varied);
    for (const Vary& vary : varied) {
        const bool shared = std::find(options.vary.begin(), options.vary.end(),
                                      part.options.vary[part.keys.size()]) != options.vary.end();
        Vary named = vary;
        if (!shared) named.key = part.label + ":" + vary.key;
        const auto there = std::ranges::find(all, named.key, &Vary::key);
        part.places.push_back(static_cast<std::size_t>(there - all.begin()));
        part.keys.push_back(vary.key);
        if (there == all.end()) all.push_back(std::move(named));
    }
    return part;
}

void read_parts(const FitOptions& options, Fit& fit) {
    const std::vector<std::string> labels = labels_of(options.recipes);
    require_labels("--target", options.targets, labels);
    require_labels("--target-profile", options.profiles, labels);
    std::size_t with_errors = 0;
    for (std::size_t r = 0; r < labels.size(); ++r) {
        fit.parts.push_back(
            about_recipe(labels[r], options, [&] { return read_part(options, labels, r, fit.varied); }));
        with_errors += fit.parts.back().targets.known_errors ? 1 : 0;
    }
    if (with_errors != 0 && with_errors != fit.parts.size())
        throw RecipeError(
            "--target: those of some recipes have a standard deviation and those of others none, so that their "
            "weights are unknown: give all of them one (+-SIGMA, --profile-sigma) or none");
}

// Reads and checks all options, so that what can be refused is refused before anything runs.
Fit read_fit(const FitOptions& options) {
    Fit fit{.options = options};
    read_parts(options, fit);
    if (fit.varied.size() > kSobolDimensions)
        throw RecipeError("--vary: a fit varies at most {} keys", kSobolDimensions);
    if (fit.parts.size() > 1) fit.columns.emplace_back("recipe");
    for (const Vary& vary : fit.varied) fit.columns.push_back(vary.key);
    fit.start = BoxPoint::Constant(static_cast<Eigen::Index>(fit.varied.size()), 0.5);
    for (auto part = fit.parts.rbegin(); part != fit.parts.rend(); ++part)  // the first recipe's values win
        for (std::size_t k = 0; k < part->keys.size(); ++k)
            if (const auto place = start_of(*part, fit.varied[part->places[k]], part->keys[k]))
                fit.start[static_cast<Eigen::Index>(part->places[k])] = *place;
    // What the rules allow at both ends of a key's range they allow between; other keys stay at their start.
    check_point(fit, fit.start);
    for (Eigen::Index k = 0; k < fit.start.size(); ++k)
        for (const double end : {0.0, 1.0}) {
            BoxPoint point = fit.start;
            point[k] = end;
            check_point(fit, point);
        }
    fit.set = {.folder = options.output,
               .jobs = options.jobs,
               .resume_command = options.resume_command,
               .needs_all = true};
    return fit;
}

Json plan_of(const Fit& fit) {
    const FitOptions& options = fit.options;
    std::string profiles, first;
    std::set<std::string> paths;
    for (const FitRecipe& part : fit.parts) {
        for (const MeasuredProfile& profile : part.targets.profiles)
            for (const Eigen::Vector2d& p : profile.points) profiles += fmt::format("{},{} ", p.x(), p.y());
        const Recipe recipe = recipe_of(part, values_of(fit, fit.start));
        first += effective_recipe(recipe);
        paths.merge(input_paths(recipe));
    }
    const Json files = files_of_plan(paths);
    return Json{
        {"version", version()},
        {"recipe", fmt::format("{}", fmt::join(options.recipes, " "))},
        {"vary", options.vary},
        {"set", options.overrides},
        {"target", options.targets},
        {"target_profile", options.profiles},
        {"profile_sigma", options.profile_sigma ? Json(*options.profile_sigma) : Json()},
        {"profile_offset", options.profile_offset},
        {"method", options.method},
        {"files", files},
        {"digest", digest(fmt::format("{} {} {} {} {}", version(), first, profiles, files,
                                      Json{options.vary, options.targets, options.profiles, options.method,
                                           options.profile_offset, options.profile_sigma.value_or(0.0)}
                                          .dump()))}};
}

// Adds the runs of a point to the set. False if its values, each of which is allowed, do not fit together.
// \param seeds  added to the recipe's seed.
bool add_point(Fit& fit, const BoxPoint& point, std::int64_t seeds) {
    const RunValues values = values_of(fit, point);
    std::vector<Recipe> recipes;
    try {
        for (const FitRecipe& part : fit.parts) {
            recipes.push_back(recipe_of(part, values));
            recipes.back().flux.seed += seeds;
        }
    } catch (const RecipeError& error) {
        fit.missing = error.what();
        return false;
    }
    fit.points.push_back(values);
    for (std::size_t r = 0; r < recipes.size(); ++r) {
        FitRecipe& part = fit.parts[r];
        part.numbers.push_back(add_run(fit.set, recipes[r]));
        part.recipes.push_back(std::move(recipes[r]));
        RunValues row = values;
        if (fit.parts.size() > 1) row.insert(row.begin(), part.label);
        fit.rows.push_back({std::move(row), part.numbers.back()});
    }
    return true;
}

Residuals residuals_at(Fit& fit, std::size_t point) {
    Residuals all = Eigen::VectorXd(0);
    for (const FitRecipe& part : fit.parts) {
        const std::size_t number = part.numbers[point];
        const SetRun& run = fit.set.runs[number - 1];
        std::string missing;
        Residuals residuals;
        if (run.status == "ok")
            residuals =
                residuals_of(part.targets, part.recipes[point], run, folder_of(fit.set, number), missing);
        if (!residuals) {
            fit.missing = run.status != "ok" ? run.status
                                             : fmt::format("run {:04} has no {}{}{}", number, part.label,
                                                           part.label.empty() ? "" : ":", missing);
            return std::nullopt;
        }
        Eigen::VectorXd joined(all->size() + residuals->size());
        joined << *all, *residuals;
        all = std::move(joined);
    }
    return all;
}

// Residuals at points, whose runs are made together. \param repeats  the points are equal: use other seeds.
std::vector<Residuals> evaluate(Fit& fit, ProgressBar& progress, const std::vector<BoxPoint>& points,
                                bool repeats) {
    std::vector<std::optional<std::size_t>> added;
    std::vector<std::size_t> numbers;
    std::int64_t seeds = 0;
    for (const BoxPoint& point : points) {
        const bool good = add_point(fit, point, repeats ? ++seeds : 0);
        added.push_back(good ? std::optional(fit.points.size() - 1) : std::nullopt);
        if (good)
            for (const FitRecipe& part : fit.parts) numbers.push_back(part.numbers.back());
    }
    make_runs(fit.set, numbers, progress, [&](std::size_t) {
        write_file(fit.options.output / "fit.csv", run_table(fit.columns, fit.rows, fit.set));
    });
    std::vector<Residuals> residuals;
    residuals.reserve(added.size());
    for (const auto& point : added) residuals.push_back(point ? residuals_at(fit, *point) : std::nullopt);
    return residuals;
}

// The profiles with their places in residuals_at(); points in the first recipe's length unit.
std::vector<ProfileResiduals> profiles_of(const Fit& fit) {
    std::vector<ProfileResiduals> profiles;
    const double unit = metres_in(fit.parts.front().length_unit);
    Eigen::Index first = 0;
    for (const FitRecipe& part : fit.parts) {
        first += static_cast<Eigen::Index>(part.targets.measures.size());
        for (const MeasuredProfile& profile : part.targets.profiles) {
            profiles.push_back({first, profile.points});
            for (Eigen::Vector2d& p : profiles.back().points) p *= metres_in(part.length_unit) / unit;
            first += static_cast<Eigen::Index>(profile.points.size());
        }
    }
    return profiles;
}

FitSearch find(Fit& fit) {
    const FitOptions& options = fit.options;
    ProgressBar progress("fit", static_cast<double>(options.max_runs), "runs at most", !options.quiet,
                         {.tenths = true});
    try {
        return search_least_squares(
            {.start = fit.start,
             .evaluate =
                 [&](const std::vector<BoxPoint>& points) { return evaluate(fit, progress, points, false); },
             .repeat =
                 [&](const BoxPoint& point, std::size_t count) {
                     return evaluate(fit, progress, std::vector<BoxPoint>(count, point), true);
                 },
             .max_runs = options.max_runs / fit.parts.size(),
             .known_errors = fit.parts.front().targets.known_errors,
             .profiles = profiles_of(fit)},
            options.method);
    } catch (const NumericsError& error) {
        throw NumericsError("{}: {}: {}", fmt::join(options.recipes, " "), error.what(), fit.missing);
    }
}

void write_best(const Fit& fit, const FitEnd& end) {
    const fs::path& folder = fit.options.output;
    for (const FittedRecipe& fitted : end.recipes) {
        const std::string label = fitted.label.empty() ? "" : "_" + fitted.label;
        write_file(folder / fmt::format("best{}.toml", label), fitted.best_run.recipe);
        for (std::size_t k = 0; k < fitted.targets.profiles.size(); ++k)
            write_file(
                folder / fmt::format("overlay{}{}.csv", label, k == 0 ? "" : fmt::format("_{}", k + 1)),
                overlay_csv(fitted, k));
    }
}

}  // namespace

Json run_fit(const FitOptions& options) {
    if (options.max_runs < options.recipes.size() || options.max_runs > kMostRuns)
        throw RecipeError("--max-runs {}: must be from {} to {}", options.max_runs, options.recipes.size(),
                          kMostRuns);
    Fit fit = read_fit(options);
    for (const FitRecipe& part : fit.parts)
        for (const MeasuredProfile& profile : part.targets.profiles)
            if (!options.quiet) print_warning(fmt::format("{}: note: {}", profile.name, profile.understood));
    make_folder(options.output, "choose another with -o");
    const FolderLock lock(options.output);
    Json json = plan_of(fit);
    open_batch_folder(options.output, kFile, "fit", json, options.resume);
    const std::string path = (options.output / kFile).string();
    adopt_runs(fit.set);
    json["status"] = "unfinished";
    // An earlier result stays until the search has ended.
    if (!fs::exists(path)) write_json(path, json);

    const FitSearch search = find(fit);
    const LeastSquaresResult& found = search.found;
    const auto best = static_cast<std::size_t>(
        std::find(fit.points.begin(), fit.points.end(), values_of(fit, found.best)) - fit.points.begin());
    FitEnd end{.varied = fit.varied, .found = found, .several_minima = search.several_minima};
    std::set<std::size_t> numbers;  // equal points share a run
    for (const FitRecipe& part : fit.parts) {
        const std::size_t number = part.numbers[best];
        end.recipes.push_back({.label = part.label,
                               .targets = part.targets,
                               .best_recipe = part.recipes[best],
                               .best_run = fit.set.runs[number - 1],
                               .best_number = number,
                               .best_folder = folder_of(fit.set, number),
                               .first_folder = folder_of(fit.set, part.numbers.front())});
        numbers.insert(part.numbers.begin(), part.numbers.end());
    }
    json.update(fit_json(end));
    json["runs"] = numbers.size();
    write_best(fit, end);
    write_json(path, json);
    return json;
}

}  // namespace sidewall::app
