#pragma once
#include <string>

#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Reads [[layer]] into \p recipe. \pre its domain and materials are read.
/// \throws RecipeError.
void read_layers(const toml::table& root, Recipe& recipe);

/// Makes the file name of the step's pattern absolute, and checks the pattern against the grid.
/// \throws RecipeError.
void place_pattern(const toml::table& table, const std::string& path, Step& step, Recipe& recipe);

}  // namespace sidewall::app
