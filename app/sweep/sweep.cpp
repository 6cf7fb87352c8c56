#include "app/sweep/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/common/version.hpp"
#include "app/process/state.hpp"
#include "app/recipe/figure_names.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

struct Sweep {
    std::vector<std::string> keys;
    std::vector<RunPoint> points;
    RunSet set;
    Json plan;  // what sweep.json holds
};

std::vector<RunValues> points_of(const SweepOptions& options, const std::vector<Vary>& varied) {
    if (options.design == "sobol") {
        if (!options.runs) throw RecipeError("--design sobol: needs --runs N, the number of points");
        return sobol_points(varied, *options.runs);
    }
    if (options.runs) throw RecipeError("--runs: goes with --design sobol; a grid has all combinations");
    return grid_points(varied);
}

// Every point's recipe is read here, before anything runs.
Sweep read_sweep(const SweepOptions& options) {
    if (options.vary.empty())
        throw RecipeError("--vary: missing: name a key and its values, e.g. step[0].rate=1:2:5");
    const Recipe base = load_recipe(options.recipe, options.overrides);
    const std::string text = surface::read_whole_file(options.recipe);
    const std::vector<Vary> varied = parse_vary(options.vary, base);
    Sweep sweep{
        .set = {.folder = options.output, .jobs = options.jobs, .resume_command = options.resume_command}};
    for (const Vary& vary : varied) sweep.keys.push_back(vary.key);
    std::string all = version();
    std::set<std::string> paths;
    for (RunValues& values : points_of(options, varied)) {
        Recipe recipe = recipe_at(text, options.recipe, options.overrides, sweep.keys, values);
        for (const std::string& name : options.measures) want_measure(recipe, name, "--measure");
        const std::size_t number = add_run(sweep.set, recipe);
        all += sweep.set.runs[number - 1].recipe;
        paths.merge(input_paths(recipe));
        sweep.points.push_back({std::move(values), number});
    }
    const Json files = files_of_plan(paths);
    sweep.plan = Json{{"version", version()},
                      {"recipe", options.recipe},
                      {"vary", options.vary},
                      {"design", options.design},
                      {"rows", sweep.points.size()},
                      {"set", options.overrides},
                      {"measure", options.measures},
                      {"files", files},
                      {"digest", digest(fmt::format("{} {}", all, files))}};
    return sweep;
}

void write_plan(const SweepOptions& options, const Sweep& sweep) {
    write_json((options.output / "sweep.json").string(), sweep.plan);
}

std::string row_of(const std::vector<std::string>& columns, const RunPoint& point, const SetRun& run) {
    std::string row = fmt::format("{:04}", point.number);
    for (const std::string& value : point.values) row += fmt::format(",{}", csv_field(value));
    const auto field = [&](const char* part, const std::string& name) {
        const Json value = run.summary.contains(part) ? run.summary[part].value(name, Json()) : Json();
        row += value.is_number() ? fmt::format(",{:.9g}", value.get<double>()) : ",";
    };
    for (const std::string& name : columns) field("metrology", name);
    field("timing", "total");
    return row + fmt::format(",{}\n", csv_field(run.status));
}

// The names of the figures that any ended run has, in the order of the points.
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

}  // namespace

SweepEnd run_sweep(const SweepOptions& options) {
    Sweep sweep = read_sweep(options);
    make_folder(options.output, "choose another with -o");
    const FolderLock lock(options.output);
    open_batch_folder(options.output, "sweep.json", "sweep", sweep.plan, options.resume);
    write_plan(options, sweep);
    std::vector<std::size_t> numbers(sweep.set.runs.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i + 1;
    SweepEnd end{.rows = sweep.points.size(), .runs = numbers.size()};
    const auto before = static_cast<double>(read_ended(sweep.set));
    ProgressBar progress("sweep", static_cast<double>(end.runs), "runs", !options.quiet,
                         {.from = before, .tenths = true});
    make_runs(sweep.set, numbers, progress, [&](std::size_t) {
        end.table = run_table(sweep.keys, sweep.points, sweep.set);
        write_file(options.output / "sweep.csv", end.table);
    });
    sweep.plan["units"] = units_of(sweep.set);
    write_plan(options, sweep);
    for (const SetRun& run : sweep.set.runs) end.failed += run.status == "ok" ? 0 : 1;
    if (end.failed == end.runs)
        throw NumericsError("{}: no run ended well: {}", options.recipe, sweep.set.runs[0].status);
    return end;
}

std::string plan_sweep(const SweepOptions& options) {
    const Sweep sweep = read_sweep(options);
    if (options.output.string().find('\n') != std::string::npos)
        throw RecipeError(
            "-o {}: --plan prints a command a line, and this folder's name has a line break: choose another one",
            surface::printable(options.output.string(), true));
    make_folder(options.output, "choose another with -o");
    const FolderLock lock(options.output);
    open_batch_folder(options.output, "sweep.json", "sweep", sweep.plan, options.resume);
    write_plan(options, sweep);
    std::string commands;
    for (std::size_t number = 1; number <= sweep.set.runs.size(); ++number) {
        write_run_recipe(sweep.set, number);
        commands += "sidewall";
        for (const std::string& word : run_arguments(sweep.set, number))
            commands += fmt::format(" {}", shell_word(word));
        commands += "\n";
    }
    return commands;
}

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

}  // namespace sidewall::app
