#include "app/process/levels.hpp"

#include <algorithm>

#include "app/recipe/grid_levels.hpp"

namespace sidewall::app {

void give_levels(const Recipe& recipe, levelset::MaterialStack& stack, const levelset::StackMaker& make) {
    const int levels = grid_levels(recipe, stack.domain);
    if (levels == 1) return;
    // Models whose speed depends on the normal take lax_friedrichs.
    levelset::AdvectionOptions turning = recipe.advection;
    turning.scheme = levelset::Scheme::lax_friedrichs;
    levelset::make_levels(
        stack, levels, std::max(levelset::margin_for(recipe.advection), levelset::margin_for(turning)), make);
}

}  // namespace sidewall::app
