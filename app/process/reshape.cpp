#include "app/process/reshape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "app/models/geometric_steps.hpp"
#include "app/models/model.hpp"
#include "app/process/recipe_levels.hpp"
#include "app/recipe/layers.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"

namespace sidewall::app {
namespace {

// Polishing below all that was ever shaped would leave a flat piece of substrate.
void refuse_to_lose_all(const Recipe& recipe, const Step& step, const levelset::MaterialStack& stack) {
    const double height = geometric_step(step.parameters)->height, lowest = lowest_point(stack);
    constexpr double kNear = 1e-2;  // in grid spacings
    if (height < lowest - kNear * stack.domain.spacing)
        throw RecipeError(fmt::format(
            "{}: step {}: height = {:g}: lies below the whole wafer, whose substrate's surface goes down to {:.4g} "
            "by then: nothing of its shape would be left; polish above that",
            recipe.file, step.name, height, lowest));
}

}  // namespace

double lowest_point(const levelset::MaterialStack& stack) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vec3& p : levelset::extract_surface(stack, 0).vertices) lowest = std::min(lowest, p.z());
    return lowest;
}

bool reshape(const Recipe& recipe, const Step& step, levelset::MaterialStack& stack) {
    const ModelEntry* entry = find_model(step.model);
    if (!entry->apply) return false;
    if (step.model == "planarize") refuse_to_lose_all(recipe, step, stack);
    // Sharp edges are made where the grid is fine, which then is coarsened where they are not.
    if (stack.coarser) stack = levelset::on_one_level(stack);
    entry->apply(*geometric_step(step.parameters), recipe.materials,
                 entry->patterned ? pattern_of(step, recipe) : levelset::Shape{}, stack);
    give_levels(recipe, stack);
    return true;
}

}  // namespace sidewall::app
