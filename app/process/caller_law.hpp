#pragma once
#include "app/process/run_options.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The model of a step that takes time, with a caller's law for its speed if there is one.
/// \param law  empty: the model's own.
/// \throws RecipeError if the model's speed turns with the normal, which no other law can stand for.
Model model_with_law(const Recipe& recipe, const CallerLaw& law, const Step& step);

}  // namespace sidewall::app
