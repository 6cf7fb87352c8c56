#pragma once
#include <string>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Makes \p recipe measure what a user names: a word of [metrology] measures, such as film, or one of the figures
/// in a summary's metrology, such as step_coverage_side, cd_at_0.5 (which adds the depth), mean_rate.
/// \param option  that names it, for messages.
/// \throws RecipeError, with the nearest name, for what no run measures.
void want_measure(Recipe& recipe, const std::string& name, const std::string& option);

/// Whether \p name is one figure, not a word that stands for several.
bool is_figure(const Recipe& recipe, const std::string& name);

/// Makes \p recipe measure one figure, as want_measure.
/// \param text  the option's value, for messages.
/// \throws RecipeError, too, for a word that stands for several figures.
void want_figure(Recipe& recipe, const std::string& name, const std::string& option, const std::string& text);

}  // namespace sidewall::app
