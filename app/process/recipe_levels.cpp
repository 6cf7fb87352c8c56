#include "app/process/recipe_levels.hpp"

#include <algorithm>

#include "app/recipe/grid_levels.hpp"
#include "levelset/layers/make_stack.hpp"

namespace sidewall::app {
namespace {

int margin_of(const Recipe& recipe) {
    // Models whose speed depends on the normal take lax_friedrichs.
    levelset::AdvectionOptions turning = recipe.advection;
    turning.scheme = levelset::Scheme::lax_friedrichs;
    return std::max(levelset::margin_for(recipe.advection), levelset::margin_for(turning));
}

}  // namespace

void give_levels(const Recipe& recipe, levelset::MaterialStack& stack) {
    const int levels = grid_levels(recipe, stack.domain);
    if (levels > 1) levelset::make_levels(stack, levels, margin_of(recipe));
}

levelset::MaterialStack stack_on_levels(const Recipe& recipe, const levelset::Domain& domain,
                                        const levelset::StackSampler& sample) {
    const int levels = grid_levels(recipe, domain);
    if (levels > 1) return levelset::make_levels(domain, levels, margin_of(recipe), sample);
    levelset::MaterialStack stack = sample(domain, {});
    levelset::make_distances(stack);
    return stack;
}

}  // namespace sidewall::app
