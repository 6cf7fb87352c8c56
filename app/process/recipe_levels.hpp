#pragma once
#include "app/recipe/recipe.hpp"
#include "levelset/layers/levels.hpp"

namespace sidewall::app {

/// Gives a stack of one level those that the recipe asks for.
void give_levels(const Recipe& recipe, levelset::MaterialStack& stack);

/// The stack of what \p sample samples, on the levels that the recipe asks for.
levelset::MaterialStack stack_on_levels(const Recipe& recipe, const levelset::Domain& domain,
                                        const levelset::StackSampler& sample);

}  // namespace sidewall::app
