#include "app/process/wafer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "app/models/geometric_steps.hpp"
#include "app/models/model.hpp"
#include "app/process/events.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/step_materials.hpp"
#include "app/results/metrology.hpp"
#include "levelset/layers/layer_depths.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/layers/make_stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/face_points.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

namespace fs = std::filesystem;

int margin_of(const Recipe& recipe) {
    // Models whose speed depends on the normal need the lax_friedrichs scheme, see scheme_for.
    levelset::AdvectionOptions turning = recipe.advection;
    turning.scheme = levelset::Scheme::lax_friedrichs;
    return std::max(levelset::margin_for(recipe.advection), levelset::margin_for(turning));
}

// Adds the coarser grid levels that the recipe asks for to a stack of one level.
void give_levels(const Recipe& recipe, levelset::MaterialStack& stack) {
    const int levels = grid_levels(recipe, stack.domain);
    if (levels > 1) levelset::make_levels(stack, levels, margin_of(recipe));
}

// Refuses a mesh that passes all other checks but separates no inside from outside: faces lie flat on others.
void refuse_folded(const levelset::MaterialStack& stack, const std::string& file) {
    try {
        levelset::extract_surface(stack);
    } catch (const NumericsError&) {
        throw GeometryError(
            "{}: the wafer of this mesh has no closed surface: faces that fold over one another do that, as of polygons "
            "that are not convex cut into a fan; export it with its polygons, or triangulated anew",
            file);
    }
}

levelset::MaterialStack stack_of_layers(const Recipe& recipe, const std::function<bool()>& stop) {
    std::vector<std::pair<int, levelset::Shape>> bodies;
    for (const MaterialLayer& layer : expanded_layers(recipe))
        bodies.emplace_back(layer.material, layer.shape);
    const auto sample = [&](const levelset::Domain& domain, const levelset::LeafChoice& where) {
        return levelset::sample_stack(domain, bodies, stop, where);
    };
    const levelset::Domain domain = domain_of(recipe);
    const int levels = grid_levels(recipe, domain);
    if (levels > 1) return levelset::make_levels(domain, levels, margin_of(recipe), sample);
    levelset::MaterialStack stack = sample(domain, {});
    levelset::make_distances(stack);
    for (const auto& [material, shape] : bodies)
        if (shape.kind == levelset::ShapeKind::mesh) refuse_folded(stack, shape.file);
    return stack;
}

bool same_time(double a, double b) {
    return std::abs(a - b) <= 1e-9 * std::max(1.0, std::abs(a));
}

// Whether a wafer was saved at the end of the step before saved.step, as steps that take time begin with a
// save.
bool ends_step(const RunState& run, const SavedStack& saved) {
    return saved.step > 0 && saved.time == run.starts[saved.step];
}

bool is_wanted(const StartSection& start, const RunState& run, const SavedStack& saved) {
    if (start.time) return same_time(*start.time, saved.time);
    return saved.step == static_cast<std::size_t>(start.step) && ends_step(run, saved);
}

// The saved times or steps that [start] could name, for a message.
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

// Refuses to polish below the whole surface of the substrate: only a flat piece of substrate would be left.
void refuse_to_lose_all(const Recipe& recipe, const Step& step, const levelset::MaterialStack& stack) {
    const double height = geometric_step(step.parameters)->height, lowest = lowest_of_substrate(stack);
    constexpr double kNear = 1e-2;  // in grid spacings
    if (height < lowest - kNear * stack.domain.spacing)
        throw RecipeError(
            "{}: step {}: height = {:g}: lies below the whole wafer, whose substrate's surface goes down to {:.4g} "
            "by then: nothing of its shape would be left; polish above that",
            recipe.file, step.name, height, lowest);
}

// The wafer that [start] names, with the material ids of the recipe.
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
    all.push_back({run.process_time(), run.step, {}});
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
    levelset::MaterialStack stack = chosen + 1 == all.size()
                                        ? levelset::on_one_level(run.stack)
                                        : stack_of_saved(start.from, run, chosen, domain_of(recipe), stop);
    for (levelset::Layer& layer : stack.layers) {
        const std::string& name = checkpoint.materials.at(static_cast<std::size_t>(layer.material));
        const std::optional<int> id = material_id(recipe.materials, name);
        if (!id)
            throw fail(fmt::format("it has the material {0}: add a [[material]] with name = \"{0}\"", name));
        layer.material = *id;
    }
    for (const StepMaterials& here : materials_by_step(recipe, layer_materials(stack))) {
        try {  // the reader knew no materials but those of films
            require_values(here, recipe.materials);
        } catch (const KeyError& error) {
            throw RecipeError("{}: {}.{}", recipe.file, here.path, error.what());
        }
    }
    give_levels(recipe, stack);
    return stack;
}

}  // namespace

RunState initial_state(const Recipe& recipe, const std::function<bool()>& stop) {
    RunState state;
    state.inputs = input_files(input_paths(recipe));
    state.stack = recipe.start.from.empty() ? stack_of_layers(recipe, stop) : stack_of_run(recipe, stop);
    state.enter(0);
    state.history = begin_history(state.stack, recipe.materials.size());
    begin_events(recipe, state);
    return state;
}

levelset::MaterialStack stack_of_saved(const fs::path& folder, const RunState& run, std::size_t number,
                                       const levelset::Domain& domain, const std::function<bool()>& stop) {
    const SavedStack& saved = run.stacks[number];
    std::vector<std::pair<int, levelset::Shape>> bodies;
    const std::size_t top = saved.materials.size() - 1;
    for (std::size_t k = 0; k <= top; ++k) {
        const fs::path file = folder / (k == top ? fmt::format("surface_{:04}.vtp", number)
                                                 : fmt::format("interface_{:04}_{}.vtp", number, k));
        const bool has_surface = std::any_of(run.files.begin(), run.files.end(),
                                             [&](const SavedFile& f) { return file.filename() == f.file; });
        if (k != top && !has_surface) continue;  // neither this layer nor those below were left
        levelset::Shape shape;
        shape.kind = levelset::ShapeKind::mesh;
        shape.file = file.string();
        bodies.emplace_back(saved.materials[k], shape);
    }
    return levelset::make_stack(domain, bodies, stop);
}

double lowest_of_substrate(const levelset::MaterialStack& stack) {
    double lowest = kInfinity;
    for (const Vec3& p : levelset::extract_surface(stack, 0).vertices) lowest = std::min(lowest, p.z());
    return lowest;
}

std::string strip_warning(const Recipe& recipe, const Step& step, std::size_t number,
                          const levelset::MaterialStack& stack) {
    if (step.model != "strip") return {};
    const std::vector<int> there = layer_materials(stack);
    const TriangleMesh surface = levelset::extract_surface(stack);
    const levelset::FacePoints faces(surface);
    std::set<int> bare;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        bare.insert(levelset::exposed_material(stack, faces.of(t)));
    std::string absent, buried;
    for (const std::string& name : geometric_step(step.parameters)->materials) {
        const int id = *material_id(recipe.materials, name);
        std::string* list = std::ranges::count(there, id) == 0 ? &absent
                            : bare.contains(id)                ? nullptr
                                                               : &buried;
        if (list != nullptr) *list += (list->empty() ? "" : ", ") + name;
    }
    std::string text;
    if (!absent.empty()) text = fmt::format("there is no {} on the wafer to strip", absent);
    if (!buried.empty())
        text += fmt::format(
            "{}{} is buried, with no place bare: it goes all the same, and what lies on it stays "
            "where it is, on a void",
            text.empty() ? "" : "; ", buried);
    return text.empty() ? text : fmt::format("step {} ({}): {}", number, step.name, text);
}

bool reshape(const Recipe& recipe, const Step& step, levelset::MaterialStack& stack) {
    const ModelEntry* entry = find_model(step.model);
    if (!entry->apply) return false;
    if (step.model == "planarize") refuse_to_lose_all(recipe, step, stack);
    // The step makes its sharp edges on the finest level everywhere; give_levels coarsens where it may.
    if (stack.coarser) stack = levelset::on_one_level(stack);
    entry->apply(*geometric_step(step.parameters), recipe.materials,
                 entry->patterned ? pattern_of(step, recipe) : levelset::Shape{}, stack);
    give_levels(recipe, stack);
    return true;
}

void require_values(const Recipe& recipe, const Step& step, const levelset::MaterialStack& stack) {
    try {
        require_values({step.name, &step, layer_materials(stack)}, recipe.materials);
    } catch (const KeyError& error) {
        throw RecipeError("{}: step {}: {}", recipe.file, step.name, error.what());
    }
}

}  // namespace sidewall::app
