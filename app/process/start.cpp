#include "app/process/start.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/process/recipe_levels.hpp"
#include "app/process/state.hpp"
#include "app/recipe/step_materials.hpp"
#include "app/results/metrology.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/layers/make_stack.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

namespace fs = std::filesystem;

bool same_time(double a, double b) {
    return std::abs(a - b) <= 1e-9 * std::max(1.0, std::abs(a));
}

// Whether the wafer is that at the end of the step before: one that takes time saves a surface when it
// begins.
bool ends_step(const RunState& run, const SavedStack& saved) {
    return saved.step > 0 && saved.time == run.starts[saved.step];
}

bool is_wanted(const StartSection& start, const RunState& run, const SavedStack& saved) {
    if (start.time) return same_time(*start.time, saved.time);
    return saved.step == static_cast<std::size_t>(start.step) && ends_step(run, saved);
}

// What the run can be left from, for a message.
std::string choices(const StartSection& start, const RunState& run, const std::vector<SavedStack>& all) {
    std::vector<std::string> list;
    for (const SavedStack& saved : all) {
        if (start.time) list.push_back(fmt::format("{:.9g}", saved.time));
        if (!start.time && ends_step(run, saved)) list.push_back(fmt::format("{}", saved.step));
    }
    constexpr std::size_t kMost = 20;
    const std::string last = list.empty() ? "none" : list.back();
    if (list.size() > kMost) {
        list.resize(kMost);
        list.push_back("... " + last);
    }
    return fmt::format("{}", fmt::join(list, ", "));
}

// The bodies below each interface, and the surface.
levelset::MaterialStack rebuilt(const fs::path& folder, std::size_t number, const SavedStack& saved,
                                const std::vector<SavedFile>& written, const levelset::Domain& domain,
                                const std::function<bool()>& stop) {
    std::vector<std::pair<int, levelset::Shape>> bodies;
    const std::size_t top = saved.materials.size() - 1;
    for (std::size_t k = 0; k <= top; ++k) {
        const fs::path file = folder / (k == top ? fmt::format("surface_{:04}.vtp", number)
                                                 : fmt::format("interface_{:04}_{}.vtp", number, k));
        const bool has_surface = std::any_of(written.begin(), written.end(),
                                             [&](const SavedFile& f) { return file.filename() == f.name; });
        if (k != top && !has_surface) continue;  // nothing was left of that layer and those below
        levelset::Shape shape;
        shape.kind = levelset::ShapeKind::mesh;
        shape.file = file.string();
        bodies.emplace_back(saved.materials[k], shape);
    }
    return levelset::make_stack(domain, bodies, stop);
}

}  // namespace

levelset::MaterialStack stack_of_run(const Recipe& recipe, const std::function<bool()>& stop) {
    const StartSection& start = recipe.start;
    Checkpoint checkpoint =
        read_checkpoint(start.from, recipe, "start from another run, or change the recipe");
    const auto fail = [&](const std::string& reason) {
        return FileError(fmt::format("{}: cannot be started from: {}", start.from, reason));
    };
    if (checkpoint.length_unit != recipe.domain.length_unit)
        throw fail(fmt::format("its domain.length_unit is {}, and this recipe's {}", checkpoint.length_unit,
                               recipe.domain.length_unit));
    RunState& run = checkpoint.state;
    std::vector<SavedStack> all = run.stacks;
    all.push_back({run.time, run.step, {}});
    std::size_t chosen = all.size() - 1;
    const bool asked = start.time || start.step > 0;
    if (!asked && !fs::exists(fs::path(start.from) / "summary.json"))
        throw fail("that run has not ended: finish it, or say where to start with start.time or start.step");
    while (asked && !is_wanted(start, run, all[chosen]))
        if (chosen-- == 0)
            throw fail(start.time
                           ? fmt::format("it saved no surface at start.time = {:.9g}; it did at {} ({})",
                                         *start.time, choices(start, run, all), recipe.domain.time_unit)
                           : fmt::format("it saved no surface at the end of start.step = {}; it did of {}",
                                         start.step, choices(start, run, all)));
    levelset::MaterialStack stack = chosen + 1 == all.size() ? levelset::on_one_level(run.stack)
                                                             : rebuilt(start.from, chosen, all[chosen],
                                                                       run.files, domain_of(recipe), stop);
    for (levelset::Layer& layer : stack.layers) {
        const std::string& name = checkpoint.materials.at(static_cast<std::size_t>(layer.material));
        const std::optional<int> id = material_id(recipe.materials, name);
        if (!id)
            throw fail(fmt::format("it has the material {0}: add a [[material]] with name = \"{0}\"", name));
        layer.material = *id;
    }
    for (const StepMaterials& here : materials_by_step(recipe, layer_materials(stack))) {
        try {  // the reader knew of no materials but those of films
            require_values(here, recipe.materials);
        } catch (const KeyError& error) {
            throw RecipeError(fmt::format("{}: {}.{}", recipe.file, here.path, error.what()));
        }
    }
    give_levels(recipe, stack);
    return stack;
}

}  // namespace sidewall::app
