#include "app/recipe/notes.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "app/models/model.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/step_materials.hpp"
#include "app/recipe/step_model.hpp"
#include "flux/radiosity/exchange.hpp"
#include "surface/cut.hpp"

namespace sidewall::app {
namespace {

// Notes on species that stay with Monte Carlo despite radiosity, and on fewer rays than asked for.
void note_radiosity(const Recipe& recipe, std::vector<std::string>& notes) {
    if (recipe.flux.method == "monte-carlo") return;
    std::vector<std::string> others;
    for (const StepMaterials& here : materials_by_step(recipe)) {
        const Model& model = *here.step->built;
        for (std::size_t k = 0; k < model.species.size(); ++k) {
            const std::string why = why_monte_carlo(model, k);
            const std::string text = fmt::format("{} ({})", model.species[k].name, why);
            if (!why.empty() && std::find(others.begin(), others.end(), text) == others.end())
                others.push_back(text);
        }
    }
    if (recipe.flux.method == "radiosity" && !others.empty())
        notes.push_back(fmt::format("flux.method = \"radiosity\": monte-carlo traces {} all the same",
                                    fmt::join(others, ", ")));
    const double bytes =
        static_cast<double>(flux::exchange_bytes(static_cast<std::uint64_t>(recipe.flux.most_rays())));
    const bool samples = !is_plane_profile(recipe.domain);
    if (recipe.flux.method == "radiosity" && samples && !recipe.flux.relative_error &&
        bytes > 1e9 * recipe.flux.memory)
        notes.push_back(
            fmt::format("flux.memory = {:g} GB holds {:.2g} of the {:.2g} rays asked for: radiosity "
                        "gathers no more",
                        recipe.flux.memory,
                        static_cast<double>(recipe.flux.most_rays()) * 1e9 * recipe.flux.memory / bytes,
                        static_cast<double>(recipe.flux.most_rays())));
}

// Notes of the models on materials that their steps meet, and on untraced beams tilted towards reflective
// sides. Such beams are no error: the wafer may be flat near the sides.
void note_steps(const Recipe& recipe, std::vector<std::string>& notes) {
    for (const StepMaterials& here : materials_by_step(recipe)) {
        const Model& model = *here.step->built;
        for (const int id : here.ids) {
            const auto m = static_cast<std::size_t>(id);
            if (m < model.notes.size() && !model.notes[m].empty())
                notes.push_back(fmt::format("{}.{}", here.path, model.notes[m]));
        }
        for (std::size_t axis = 0; axis < 2 && model.beam; ++axis)
            if ((*model.beam)[static_cast<Eigen::Index>(axis)] != 0.0 &&
                recipe.domain.boundary[axis] == levelset::Side::reflective)
                notes.push_back(fmt::format(
                    "{}.direction is tilted along {}, but the reflective sides there mirror the beam: "
                    "right only if the wafer is flat near them, else set domain.boundary to periodic",
                    here.path, "xy"[axis]));
    }
}

// Upper bound of an added layer's z, on a flat surface at z = \p flat; infinite for a mesh or profile.
double highest_of(const Layer& layer, double flat) {
    const std::string& shape = layer.shape;
    if (shape == "mesh" || shape == "profile") return kInfinity;
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

// Height below which an added layer fills the whole domain; minus infinity if there is none.
double filled_below(const Layer& layer, double highest) {
    const std::string& shape = layer.shape;
    if (shape == "plane" || shape == "stack") return highest;
    if (shape == "fin" || shape == "box") return *layer.top;
    if (shape == "trench" || shape == "hole") return *layer.top - layer.depth.value_or(kInfinity);
    return -kInfinity;
}

// Layers are united with those below, so a layer that is nowhere higher has no effect.
void note_hidden_layers(const Recipe& recipe, std::vector<std::string>& notes) {
    double flat = 0.0, filled = -kInfinity;
    for (std::size_t k = 0; k < recipe.layers.size(); ++k) {
        const Layer& layer = recipe.layers[k];
        if (layer.subtract) {
            filled = -kInfinity;
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

// Notes on parts without effect: layers hidden by those below, values for materials that a step does not
// meet, stop conditions that never hold.
void note_idle_parts(const Recipe& recipe, std::vector<std::string>& notes) {
    note_hidden_layers(recipe, notes);
    if (!recipe.start.from.empty()) return;  // the earlier run decides what is on the wafer
    for (const StepMaterials& here : materials_by_step(recipe)) {
        for (const auto& [key, names] : idle_values(here, recipe.materials))
            notes.push_back(fmt::format("{}.{} does nothing for {}: not on the wafer in this step", here.path,
                                        key, fmt::join(names, ", ")));
        note_stops(here, recipe, notes);
    }
}

// Proposes a profile where the wafer is the same at all y, and says how to write it.
std::string profile_note(const Recipe& recipe) {
    const bool across = surface::parse_plane(recipe.metrology.cut).normal.y() == 0.0;
    if (across || !is_same_along_y(recipe)) return {};
    return fmt::format(
        "All is the same along y: extent = [{:g}] in [domain] makes it a profile in x and z, one cell wide in place of "
        "{}, and its volumes areas.",
        recipe.domain.extent[0], domain_of(recipe).cells[1]);
}

// Proposes a profile in r and z where the wafer is round about its middle, and says how to write it.
std::string round_note(const Recipe& recipe) {
    DomainSection domain = recipe.domain;
    const auto [shorter, longer] = std::minmax(domain.extent[0], domain.extent[1]);
    constexpr double kSquare = 1.2;  // more elongated cells have no round equivalent
    if (longer > kSquare * shorter) return {};
    const double widest = 0.5 * shorter;
    domain.extent = {std::sqrt(domain.extent[0] * domain.extent[1] / std::numbers::pi), 0.0};
    domain.symmetry = Symmetry::axial;
    bool any = false;
    const auto is_round = [&](const Layer& layer) {
        const bool round = layer.shape == "hole" || layer.shape == "sphere" ||
                           (layer.shape == "cylinder" && layer.axis == "z");
        any = any || round;
        return layer.position == std::array<double, 2>{} &&
               ((round && layer.radius < widest) || layer.shape == "plane" || layer.shape == "stack");
    };
    std::set<const Model*> known;  // a loop's cycles share their model
    const auto can_be_round = [&](const Step& step) {
        if (step.built && !known.insert(step.built.get()).second) return true;
        if (find_model(step.model)->patterned && !is_round(step.pattern)) return false;
        try {
            make_model(step, recipe.materials, domain);
        } catch (const RecipeError&) {
            return false;
        }
        return true;
    };
    if (!std::ranges::all_of(recipe.layers, is_round) ||
        !std::ranges::all_of(expanded_steps(recipe), can_be_round) || !any)
        return {};
    return fmt::format(
        "All is round about the middle: extent = [{:.4g}] and symmetry = \"axial\" in [domain] make it a profile in r "
        "and z, which costs a small part of it.{}",
        domain.extent[0],
        recipe.simplify.method == "auto" || recipe.simplify.method == "none"
            ? ""
            : " Leave [simplify] out then: to coarsen a profile saves nothing, and less exact fluxes move "
              "its walls.");
}

}  // namespace

std::vector<std::string> notes_on(const Recipe& recipe) {
    std::vector<std::string> notes = recipe.notes;
    const double wanted = recipe.domain.grid_spacing, spacing = domain_of(recipe).spacing;
    if (std::abs(spacing - wanted) > 1e-6 * wanted)
        notes.push_back(fmt::format("domain.grid_spacing = {:g} is rounded to {:g} {}, which divides {}",
                                    wanted, spacing, recipe.domain.length_unit,
                                    is_flat(recipe.domain) ? "the extent" : "both extents"));
    note_idle_parts(recipe, notes);
    note_steps(recipe, notes);
    note_radiosity(recipe, notes);
    return notes;
}

std::string cheaper_form(const Recipe& recipe) {
    if (recipe.domain.strip == Strip::profile)
        return fmt::format(
            "The strip of {:g} {} is the same along y and runs as a profile in x and z; strip = \"space\" in [domain] "
            "runs it in space.",
            recipe.domain.extent[1], recipe.domain.length_unit);
    if (is_flat(recipe.domain) || !recipe.start.from.empty()) return {};
    const std::string profile = profile_note(recipe);
    return profile.empty() ? round_note(recipe) : profile;
}

}  // namespace sidewall::app
