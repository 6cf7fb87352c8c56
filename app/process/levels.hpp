#pragma once
#include "app/recipe/recipe.hpp"
#include "levelset/stack.hpp"

namespace sidewall::app {

/// Gives a stack of one level those that the recipe asks for.
void give_levels(const Recipe& recipe, levelset::MaterialStack& stack);

}  // namespace sidewall::app
