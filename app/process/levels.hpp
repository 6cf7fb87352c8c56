#pragma once
#include "app/recipe/recipe.hpp"
#include "levelset/levels.hpp"

namespace sidewall::app {

/// Gives a stack of one level those that the recipe asks for.
/// \param make  as in levelset::make_levels.
void give_levels(const Recipe& recipe, levelset::MaterialStack& stack, const levelset::StackMaker& make = {});

}  // namespace sidewall::app
