#pragma once
#include <string>

#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Reads [[layer]] into \p recipe, whose domain and materials are read.
/// \throws RecipeError.
void read_layers(const toml::table& root, Recipe& recipe);

/// Makes file names of the step's pattern absolute and checks that it makes sense on the grid.
/// \throws RecipeError.
void place_pattern(const toml::table& table, const std::string& path, Step& step, Recipe& recipe);

}  // namespace sidewall::app
