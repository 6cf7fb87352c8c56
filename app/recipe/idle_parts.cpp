#include "app/recipe/idle_parts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "app/models/model.hpp"
#include "app/recipe/step_materials.hpp"

namespace sidewall::app {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

// The highest point that an added layer may have, from the flat surface \p flat of those below; infinite
// where a file says.
double highest_of(const Layer& layer, double flat) {
    const std::string& shape = layer.shape;
    if (shape == "mesh" || shape == "profile") return kEndless;
    if (shape == "stack") {
        for (const double thickness : layer.thicknesses)
            flat += static_cast<double>(layer.repeat) * thickness;
        return flat;
    }
    if (shape == "sphere" || (shape == "cylinder" && layer.axis != "z")) return *layer.z + layer.radius;
    if (shape == "cylinder") return *layer.z + 0.5 * *layer.length;
    if (shape == "gap") return *layer.z + 0.5 * layer.height;
    return *layer.top + (shape == "fin" || shape == "box" ? layer.height : 0.0);
}

// The height below which an added layer leaves no gas; minus infinity if it leaves some at any depth.
double filled_below(const Layer& layer, double highest) {
    const std::string& shape = layer.shape;
    if (shape == "plane" || shape == "stack") return highest;
    if (shape == "fin" || shape == "box") return *layer.top;
    if (shape == "trench" || shape == "hole") return *layer.top - layer.depth.value_or(kEndless);
    return -kEndless;
}

// Layers are united with those below: what lies no higher than these is theirs.
void note_hidden_layers(const Recipe& recipe, std::vector<std::string>& notes) {
    double flat = 0.0, filled = -kEndless;
    for (std::size_t k = 0; k < recipe.layers.size(); ++k) {
        const Layer& layer = recipe.layers[k];
        if (layer.subtract) {
            filled = -kEndless;
            continue;
        }
        const double highest = highest_of(layer, flat), tiny = 1e-9 * recipe.domain.grid_spacing;
        if (k > 0 && highest <= filled + tiny)
            notes.push_back(fmt::format(
                "layer[{}] does nothing: {} reaches up to z = {:g}, and the layers below it fill all up to {:g}; "
                "give it a higher top, or drop it",
                k, layer.material.empty() ? layer.shape : layer.material, highest, filled));
        filled = std::max(filled, filled_below(layer, highest));
        flat = layer.shape == "stack" ? highest : layer.top.value_or(flat);
    }
}

void note_stops(const StepMaterials& here, const Recipe& recipe, std::vector<std::string>& notes) {
    const Step& step = *here.step;
    if (step.stop_thickness && !step.built->deposit)
        notes.push_back(fmt::format(
            "{}.stop_thickness never ends the step, which grows no film: name the film as deposit, or use stop_depth, "
            "stop_material or stop",
            here.path));
    const auto id = material_id(recipe.materials, step.stop_material);
    if (id && std::ranges::count(here.ids, *id) == 0)
        notes.push_back(fmt::format("{}.stop_material never ends the step: no {} is on the wafer", here.path,
                                    step.stop_material));
}

}  // namespace

std::vector<std::string> idle_parts(const Recipe& recipe) {
    std::vector<std::string> notes;
    note_hidden_layers(recipe, notes);
    if (!recipe.start.from.empty()) return notes;  // what is on its wafer, the run tells
    for (const StepMaterials& here : materials_by_step(recipe)) {
        for (const auto& [key, names] : idle_values(here, recipe.materials))
            notes.push_back(fmt::format("{}.{} does nothing for {}: not on the wafer in this step", here.path,
                                        key, fmt::join(names, ", ")));
        note_stops(here, recipe, notes);
    }
    return notes;
}

}  // namespace sidewall::app
