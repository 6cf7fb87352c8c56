#include "app/recipe/notes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/recipe/flat.hpp"
#include "app/recipe/idle_parts.hpp"
#include "app/recipe/step_materials.hpp"
#include "app/recipe/step_model.hpp"
#include "flux/radiosity/exchange.hpp"

namespace sidewall::app {
namespace {

// Species that stay with Monte Carlo although radiosity is asked for, and fewer rays than asked for.
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
        static_cast<double>(flux::exchange_bytes(static_cast<std::uint64_t>(recipe.flux.rays)));
    if (recipe.flux.method == "radiosity" && !recipe.flux.relative_error && bytes > 1e9 * recipe.flux.memory)
        notes.push_back(fmt::format(
            "flux.memory = {:g} GB holds {:.2g} of the {:.2g} rays asked for: radiosity "
            "gathers no more",
            recipe.flux.memory, static_cast<double>(recipe.flux.rays) * 1e9 * recipe.flux.memory / bytes,
            static_cast<double>(recipe.flux.rays)));
}

// The models' notes on the materials that their steps meet, and parallel beams that are not traced and
// lean towards reflective sides: the wafer may be flat there.
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
                    "{}.direction is tilted along {}, but beyond the reflective sides there a mirrored beam "
                    "would fall: right only if the wafer is flat near them, else set domain.boundary to "
                    "periodic",
                    here.path, "xy"[axis]));
    }
}

}  // namespace

std::vector<std::string> notes_on(const Recipe& recipe) {
    std::vector<std::string> notes = recipe.notes;
    const double wanted = recipe.domain.grid_spacing, spacing = domain_of(recipe).spacing;
    if (std::abs(spacing - wanted) > 1e-6 * wanted)
        notes.push_back(fmt::format("domain.grid_spacing = {:g} is rounded to {:g} {}, which divides {}",
                                    wanted, spacing, recipe.domain.length_unit,
                                    is_flat(recipe.domain) ? "the extent" : "both extents"));
    const std::vector<std::string> idle = idle_parts(recipe);
    notes.insert(notes.end(), idle.begin(), idle.end());
    note_steps(recipe, notes);
    note_radiosity(recipe, notes);
    return notes;
}

}  // namespace sidewall::app
