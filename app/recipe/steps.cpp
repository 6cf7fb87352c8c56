#include "app/recipe/steps.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/models/geometric_steps.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/layer_reader.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/reader.hpp"
#include "app/recipe/step_model.hpp"
#include "app/schema/units.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr double kMostSteps = 100'000;  // after loops are unrolled
constexpr double kLongestRun = kHuge;   // process time

// Deepest nesting of loops: a path such as step[0].steps[1].species[0].yields[0].name then has at most
// kMostKeyParts parts.
constexpr int kMostLoops = static_cast<int>(kMostKeyParts) - 4;

// Sum of a quantity over the steps, each counted as often as loops repeat it.
double total(const std::vector<Step>& steps, double (*of)(const Step&)) {
    double sum = 0.0;
    for (const Step& step : steps)
        sum += static_cast<double>(step.repeat) * (step.steps.empty() ? of(step) : total(step.steps, of));
    return sum;
}

Step read_step(const toml::table& table, const std::string& path, Recipe& recipe, int depth);

// \p depth is the number of loops around the steps.
std::vector<Step> read_list(const toml::table& parent, std::string_view key, const std::string& path,
                            Recipe& recipe, int depth) {
    std::vector<Step> steps;
    const auto tables = tables_of(parent, key, path);
    for (std::size_t i = 0; i < tables.size(); ++i)
        steps.push_back(read_step(*tables[i], fmt::format("{}[{}]", path, i), recipe, depth));
    return steps;
}

// Makes the path of a CSV file absolute, relative to the recipe's folder, and reads it for errors and notes.
void find_file(const toml::table& table, const std::string& path, const Key& key, const std::string& inner,
               Recipe& recipe) {
    std::string* const* target = std::get_if<std::string*>(&key.target);
    if (target == nullptr || (*target)->empty() || !names_file(key)) return;
    std::string& name = **target;
    const std::filesystem::path folder = std::filesystem::path(recipe.file).parent_path();
    name = std::filesystem::absolute(folder / name).lexically_normal().string();
    std::error_code failure;
    if (!std::filesystem::is_regular_file(name, failure))
        located(table, path,
                [&] { raise_key(inner, "no such file: {}; the name is relative to the recipe", name); });
    try {
        CsvTable csv = read_csv(name);
        if (key.name == "file")  // a table has units; a source has no lengths or times
            convert_columns(csv, {recipe.domain.length_unit, recipe.domain.time_unit});
        recipe.notes.push_back(fmt::format("{}.{}: {}", path, inner, csv.understood));
    } catch (const FileError& error) {
        throw FileError("{}: {}.{}: {}", place_of(table), path, inner, error.what());
    }
}

Step read_step(const toml::table& table, const std::string& path, Recipe& recipe, int depth) {
    const Reading reading{recipe.materials, recipe.notes};
    Step step;
    if (const toml::node* steps = table.get("steps")) {
        if (table.contains("model"))
            fail(*steps, path + ".steps", "a step has a model or steps of its own, not both; drop one");
        if (depth == kMostLoops)
            fail_missing(
                *steps, path + ".steps",
                fmt::format("lies in {} loops: they nest no deeper; repeat more steps in fewer", depth));
        read_keys(table, path, "a loop", keys_of(step), reading, {"steps"});
        step.steps = read_list(table, "steps", path + ".steps", recipe, depth + 1);
        return step;
    }
    const Rule rule = one_of(model_names());
    read_key(table, path, {"model", &step.model, "", "", rule}, reading);  // decides which keys the step has
    if (step.model.empty())
        fail_missing(table, path + ".model",
                     "missing: name a model that `sidewall models` lists, or give the step steps");
    const ModelEntry& model = *find_model(step.model);
    step.parameters = model.defaults;
    if (model.patterned) read_key(table, path, pattern_keys(step.pattern)[0], reading);  // as does its shape
    read_keys(table, path, "a step of model " + step.model, keys_of(step), reading);
    each_key(model_keys(step),
             [&](const Key& key, const std::string& inner) { find_file(table, path, key, inner, recipe); });
    if (model.patterned) place_pattern(table, path, step, recipe);
    if (model.make)
        step.built = located(table, path, [&] {
            return std::make_shared<const Model>(make_model(step, recipe.materials, recipe.domain));
        });
    return step;
}

// Lowest point of the wafer as its layers make it; minus infinity if an earlier run, a mesh, a profile or a
// cut-out layer decides it.
double lowest_start(const Recipe& recipe) {
    double lowest = kInfinity;
    if (!recipe.start.from.empty()) return -lowest;
    for (const Layer& layer : recipe.layers) {
        if (layer.shape == "mesh" || layer.shape == "profile" || layer.subtract) return -lowest;
        if (layer.top) lowest = std::min(lowest, *layer.top - layer.depth.value_or(0.0));
    }
    return lowest;
}

// Checks that a cut through the substrate, which is endless, has a depth. Lowers \p lowest to the cut.
void check_cut(const Step& step, const toml::table& table, const std::string& path, const Recipe& recipe,
               double& lowest) {
    const std::optional<double>& depth = geometric_step(step.parameters)->depth;
    const std::vector<std::string>& materials = geometric_step(step.parameters)->materials;
    const bool substrate =
        materials.empty() ||
        (!recipe.layers.empty() &&
         std::find(materials.begin(), materials.end(), recipe.layers.front().material) != materials.end());
    located(table, path, [&] {
        if (!depth && substrate)
            throw KeyError(
                "depth", "missing: a cut through the substrate must end somewhere, or name other materials");
        if (depth && std::abs(*depth) > kMostCells * recipe.domain.grid_spacing)
            raise_key("depth", "is over {:g} cells; check the unit or use a larger grid_spacing", kMostCells);
    });
    if (depth && substrate) lowest = std::min(lowest, -*depth);
}

void check_geometric(const toml::table& root, Recipe& recipe) {
    double lowest =
        lowest_start(recipe);  // minus infinity from the first step on that takes time: it might etch
    const auto refuse = [&](const std::string& key_path, const std::string& rule) {
        fail(*find_node(root, key_path), key_path, rule);
    };
    each_step(recipe.steps, [&](const Step& step, const std::string& here) {
        if (!step.steps.empty()) return;
        const GeometricStep* shaping = geometric_step(step.parameters);
        if (shaping == nullptr) {
            lowest = -kInfinity;
            return;
        }
        for (const auto& [key, length] :
             {std::pair("height", shaping->height), std::pair("thickness", shaping->thickness)})
            if (std::abs(length) > kMostCells * recipe.domain.grid_spacing)
                refuse(here + "." + key,
                       fmt::format("is over {:g} cells; check the unit or use a larger grid_spacing",
                                   kMostCells));
        if (step.model == "cut") check_cut(step, *find_node(root, here)->as_table(), here, recipe, lowest);
        if (step.model == "strip" && !recipe.layers.empty() &&
            std::ranges::count(shaping->materials, recipe.layers.front().material) > 0)
            refuse(here + ".material", "the substrate cannot be taken away: name another material");
        if (step.model == "fill" && shaping->height <= lowest)
            recipe.notes.push_back(fmt::format(
                "{}.height = {:g} lies below the whole wafer, whose lowest point is at {:g}: the step fills nothing; "
                "fill higher, or drop it",
                here, shaping->height, lowest));
        if (step.model == "planarize" && shaping->height < lowest)
            refuse(
                here + ".height",
                fmt::format("lies below the whole wafer, whose lowest point is at {:g}: nothing of its shape "
                            "would be left; polish above that",
                            lowest));
    });
}

}  // namespace

std::vector<Key> keys_of(Step& step) {
    std::vector<Key> list = {
        {"name", &step.name, "", "name of the step in reports"},
        {"repeat", &step.repeat, "", "number of times that the step runs", within(1, 100'000)}};
    const ModelEntry* model = find_model(step.model);
    if (model == nullptr) return list;
    list.insert(list.begin(), {"model", &step.model, "", "process model; `sidewall models` lists all",
                               required(one_of(model_names()))});
    if (model->make) {  // a geometric step takes no time
        list.insert(
            list.begin() + 1,
            {"chemistry", &step.chemistry, "",
             "published numbers for this model: a name that `sidewall models chemistry` lists, or a .toml "
             "file of your own, relative to the recipe; keys of the step take precedence"});
        list.push_back({"duration", &step.duration, "time",
                        "process time of the step; a stop condition may end it earlier",
                        required(kPositive)});
        list.push_back({"stop_depth", &step.stop_depth, "length",
                        "ends the step when the lowest point is that far below z = 0"});
        list.push_back(
            {"stop_material", &step.stop_material, "",
             fmt::format(
                 "ends the step when this material is bare on more than {:g} of the floor area under the "
                 "openings, as stop = \"bare(MATERIAL) > {:g}\" does",
                 kBareShare, kBareShare),
             kMaterial});
        list.push_back({"stop_thickness", &step.stop_thickness, "length",
                        "ends the step when the uppermost layer is that thick somewhere", kPositive});
        list.push_back(
            {"stop", &step.stop, "",
             "condition that ends the step: a bare share of the floor area under the openings, such as "
             "\"bare(Si) > 0.9\", or a figure of [metrology] measures above or below a value in the "
             "recipe's units, such as \"depth > 2.0\" or \"cd_SiO2_at_0.5 < 0.3\". The surface moves at "
             "most a twentieth of a grid spacing beyond a length or volume; angles and ratios are checked "
             "at the end of each time step"});
        list.push_back({"over_etch", &step.over_etch, "",
                        "over-etch after the stop condition holds, as a share of the step's time until then",
                        within(0.0, 1000.0)});
        list.push_back({"over_etch_time", &step.over_etch_time, "time",
                        "time of over-etch after the stop condition holds", within(0.0, kHuge)});
    }
    append_keys(list, model->keys(step.parameters));
    if (model->patterned) append_keys(list, pattern_keys(step.pattern));
    return list;
}

std::vector<Key> model_keys(const Step& step) {
    const ModelEntry* model = find_model(step.model);
    // The keys have writable targets; callers of this function only read them.
    return model == nullptr ? std::vector<Key>() : model->keys(const_cast<std::any&>(step.parameters));
}

std::vector<NamedStep> named_steps(const std::vector<Step>& steps) {
    std::vector<NamedStep> found;
    each_step(steps, [&](const Step& step, const std::string& path) {
        if (!step.name.empty()) found.push_back({step.name, path});
    });
    return found;
}

void read_steps(const toml::table& root, Recipe& recipe) {
    recipe.steps = read_list(root, "step", "step", recipe, 0);
    if (recipe.steps.empty())
        fail_missing(root, "step", "missing: a recipe needs something to do: add a [[step]]");
    if (const double count = total(recipe.steps, [](const Step&) { return 1.0; }); count > kMostSteps)
        fail_missing(
            *root.get("step"), "step",
            fmt::format("loops make {:.3g} steps, over {:g}; repeat fewer times", count, kMostSteps));
    if (total(recipe.steps, [](const Step& step) { return step.duration; }) > kLongestRun)
        fail_missing(*root.get("step"), "step",
                     fmt::format("durations add up to over {:g}; check the unit", kLongestRun));
    check_geometric(root, recipe);
}

}  // namespace sidewall::app
