#pragma once
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// z of the lowest point of the substrate's surface, bare or covered; +infinity if nothing is left of it.
double lowest_point(const levelset::MaterialStack& stack);

/// Does a geometric step, which happens at once.
/// \param step  of expanded_steps.
/// \returns false, with nothing done, if the step takes time.
/// \throws RecipeError if `planarize` would cut below all of the substrate's surface.
bool reshape(const Recipe& recipe, const Step& step, levelset::MaterialStack& stack);

}  // namespace sidewall::app
