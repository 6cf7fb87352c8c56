#include <fmt/format.h>

#include <cmath>

#include "app/recipe/recipe.hpp"
#include "app/recipe/step_model.hpp"

namespace sidewall::app {
namespace {

// A parallel beam that is not traced may lean towards reflective sides: the wafer may be flat there.
void note_mirrored_beams(const Recipe& recipe, const std::vector<Step>& steps, const std::string& path,
                         std::vector<std::string>& notes) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const std::string here = fmt::format("{}[{}]", path, i);
        if (!steps[i].steps.empty()) {
            note_mirrored_beams(recipe, steps[i].steps, here + ".steps", notes);
            continue;
        }
        const Model model = make_model(steps[i], recipe.materials, recipe.domain);
        for (std::size_t axis = 0; axis < 2 && model.beam; ++axis)
            if ((*model.beam)[static_cast<Eigen::Index>(axis)] != 0.0 &&
                recipe.domain.boundary[axis] == levelset::Side::reflective)
                notes.push_back(fmt::format(
                    "{}.direction is tilted along {}, but beyond the reflective sides there a mirrored beam "
                    "would fall: right only if the wafer is flat near them, else set domain.boundary to "
                    "periodic",
                    here, "xy"[axis]));
    }
}

}  // namespace

std::vector<std::string> notes_on(const Recipe& recipe) {
    std::vector<std::string> notes = recipe.notes;
    const double wanted = recipe.domain.grid_spacing, spacing = domain_of(recipe).spacing;
    if (std::abs(spacing - wanted) > 1e-6 * wanted)
        notes.push_back(
            fmt::format("domain.grid_spacing = {:g} is rounded to {:g} {}, which divides both extents",
                        wanted, spacing, recipe.domain.length_unit));
    note_mirrored_beams(recipe, recipe.steps, "step", notes);
    return notes;
}

}  // namespace sidewall::app
