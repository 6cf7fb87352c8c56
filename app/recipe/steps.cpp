#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "app/recipe/layers.hpp"
#include "app/recipe/reader.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/step_model.hpp"

namespace sidewall::app {
namespace {

constexpr double kMostSteps = 100'000;  // after loops are unrolled
constexpr double kLongestRun = kHuge;   // process time

double unrolled(const std::vector<Step>& steps) {
    double count = 0.0;
    for (const Step& step : steps)
        count += static_cast<double>(step.repeat) * (step.steps.empty() ? 1.0 : unrolled(step.steps));
    return count;
}

double duration(const std::vector<Step>& steps) {
    double time = 0.0;
    for (const Step& step : steps)
        time +=
            static_cast<double>(step.repeat) * (step.steps.empty() ? step.duration : duration(step.steps));
    return time;
}

Step read_step(const toml::table& table, const std::string& path, Recipe& recipe);

std::vector<Step> read_list(const toml::table& parent, std::string_view key, const std::string& path,
                            Recipe& recipe) {
    std::vector<Step> steps;
    const auto tables = tables_of(parent, key, path);
    for (std::size_t i = 0; i < tables.size(); ++i)
        steps.push_back(read_step(*tables[i], fmt::format("{}[{}]", path, i), recipe));
    return steps;
}

// Keys that name files count from the recipe's folder.
void find_files(const toml::table& table, const std::string& path, const std::string& inner,
                const std::filesystem::path& folder, Values& values) {
    for (auto& entry : values.entries) {
        const std::string& key = entry.first;
        auto& value = entry.second;
        if (auto* tables = std::get_if<std::vector<Values>>(&value))
            for (std::size_t i = 0; i < tables->size(); ++i)
                find_files(table, path, fmt::format("{}{}[{}].", inner, key, i), folder, (*tables)[i]);
        auto* name = std::get_if<std::string>(&value);
        if (name == nullptr || name->empty() || (key != "file" && !key.ends_with("_file"))) continue;
        *name = std::filesystem::absolute(folder / *name).lexically_normal().string();
        std::error_code failure;
        if (!std::filesystem::is_regular_file(*name, failure))
            located(table, path, [&] {
                throw KeyError(inner + key,
                               fmt::format("no such file: {}; the name is relative to the recipe", *name));
            });
    }
}

Step read_step(const toml::table& table, const std::string& path, Recipe& recipe) {
    const Reading reading{recipe.materials, recipe.notes};
    Step step;
    if (const toml::node* steps = table.get("steps")) {
        if (table.contains("model"))
            fail(*steps, path + ".steps", "a step has a model or steps of its own, not both; drop one");
        read_fields(table, path, "a loop", fields(step), reading, {"steps"});
        step.steps = read_list(table, "steps", path + ".steps", recipe);
        return step;
    }
    const Rule rule{.choices = model_names()};
    read_field(table, path, {"model", &step.model, "", "", rule}, reading);  // decides which keys there are
    if (step.model.empty())
        fail_missing(table, path + ".model",
                     "missing: name a model that `sidewall models` lists, or give the step steps");
    const bool patterned = find_model(step.model)->patterned;
    if (patterned) read_field(table, path, pattern_fields(step.pattern)[0], reading);  // so does its shape
    read_fields(table, path, "a step of model " + step.model, fields(step), reading);
    find_files(table, path, "", std::filesystem::path(recipe.file).parent_path(), step.values);
    if (patterned) place_pattern(table, path, step, recipe);
    if (find_model(step.model)->make != nullptr)
        located(table, path, [&] { make_model(step, recipe.materials, recipe.domain); });
    return step;
}

void unroll(const std::vector<Step>& steps, const std::string& number, const std::string& cycles,
            std::vector<Step>& list) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const Step& step = steps[i];
        const std::string label =
            number.empty() ? fmt::format("{}", i + 1) : fmt::format("{}.{}", number, i + 1);
        for (std::int64_t cycle = 1; cycle <= step.repeat; ++cycle) {
            std::string here = cycles;
            if (step.repeat > 1)
                here += fmt::format("{}cycle {} of {}", cycles.empty() ? "" : ", ", cycle, step.repeat);
            if (!step.steps.empty()) {
                unroll(step.steps, label, here, list);
                continue;
            }
            Step flat = step;
            flat.repeat = 1;
            flat.name = fmt::format("{} {}", label, step.name.empty() ? step.model : step.name);
            if (!here.empty()) flat.name += " (" + here + ")";
            list.push_back(std::move(flat));
        }
    }
}

// The lowest point of the wafer as its layers make it; minus infinity where a mesh file or an earlier run
// decides.
double lowest_start(const Recipe& recipe) {
    double lowest = std::numeric_limits<double>::infinity();
    if (!recipe.start.from.empty()) return -lowest;
    for (const Layer& layer : recipe.layers) {
        if (layer.shape == "mesh" || layer.shape == "profile" || layer.subtract) return -lowest;
        if (layer.top) lowest = std::min(lowest, *layer.top - layer.depth.value_or(0.0));
    }
    return lowest;
}

// A cut must end above the bottom of what has none.
void check_cut(const Step& step, const toml::table& table, const std::string& path, const Recipe& recipe,
               double& lowest) {
    const auto& depth = step.values.get<std::optional<double>>("depth");
    const auto& materials = step.values.get<std::vector<std::string>>("materials");
    const bool substrate =
        materials.empty() ||
        (!recipe.layers.empty() &&
         std::find(materials.begin(), materials.end(), recipe.layers.front().material) != materials.end());
    located(table, path, [&] {
        if (!depth && substrate)
            throw KeyError(
                "depth", "missing: a cut through the substrate must end somewhere, or name other materials");
        if (depth && std::abs(*depth) > kMostCells * recipe.domain.grid_spacing)
            throw KeyError(
                "depth",
                fmt::format("is over {:g} cells; check the unit or use a larger grid_spacing", kMostCells));
    });
    if (depth && substrate) lowest = std::min(lowest, -*depth);
}

// Heights and thicknesses of geometric steps. \p lowest is the wafer's lowest point for as long as it is
// known: until a step takes time, which may etch.
void check_geometric(const toml::table& root, const std::vector<Step>& steps, const std::string& path,
                     const Recipe& recipe, double& lowest) {
    const auto refuse = [&](const std::string& key_path, const std::string& rule) {
        fail(*find_node(root, key_path), key_path, rule);
    };
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const std::string here = fmt::format("{}[{}]", path, i);
        const Step& step = steps[i];
        if (!step.steps.empty()) {
            check_geometric(root, step.steps, here + ".steps", recipe, lowest);
            continue;
        }
        if (find_model(step.model)->make != nullptr) {
            lowest = -std::numeric_limits<double>::infinity();
            continue;
        }
        for (const char* key : {"height", "thickness"}) {
            const double spacing = recipe.domain.grid_spacing;
            if (step.values.entries.contains(key) &&
                std::abs(step.values.get<double>(key)) > kMostCells * spacing)
                refuse(here + "." + key,
                       fmt::format("is over {:g} cells; check the unit or use a larger grid_spacing",
                                   kMostCells));
        }
        if (step.model == "cut") check_cut(step, *find_node(root, here)->as_table(), here, recipe, lowest);
        if (step.model == "strip" && !recipe.layers.empty() &&
            step.values.get<std::string>("material") == recipe.layers.front().material)
            refuse(here + ".material", "the substrate cannot be taken away: name another material");
        if (step.model == "planarize" && step.values.get<double>("height") < lowest)
            refuse(
                here + ".height",
                fmt::format("lies below the whole wafer, whose lowest point is at {:g}: nothing of its shape "
                            "would be left; polish above that",
                            lowest));
    }
}

}  // namespace

void read_steps(const toml::table& root, Recipe& recipe) {
    recipe.steps = read_list(root, "step", "step", recipe);
    if (recipe.steps.empty())
        fail_missing(root, "step", "missing: a recipe needs something to do: add a [[step]]");
    if (const double count = unrolled(recipe.steps); count > kMostSteps)
        fail_missing(
            *root.get("step"), "step",
            fmt::format("loops make {:.3g} steps, over {:g}; repeat fewer times", count, kMostSteps));
    if (duration(recipe.steps) > kLongestRun)
        fail_missing(*root.get("step"), "step",
                     fmt::format("durations add up to over {:g}; check the unit", kLongestRun));
    double lowest = lowest_start(recipe);
    check_geometric(root, recipe.steps, "step", recipe, lowest);
}

std::vector<Step> expanded_steps(const Recipe& recipe) {
    std::vector<Step> list;
    unroll(recipe.steps, "", "", list);
    return list;
}

double total_duration(const std::vector<Step>& steps) {
    double total = 0.0;
    for (const Step& step : steps) total += step.duration;
    return total;
}

}  // namespace sidewall::app
