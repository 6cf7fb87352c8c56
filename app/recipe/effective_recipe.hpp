#pragma once
#include <string>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The whole recipe as TOML with every default written out. Parses back to an equal recipe, but for the notes.
std::string effective_recipe(const Recipe& recipe);

}  // namespace sidewall::app
