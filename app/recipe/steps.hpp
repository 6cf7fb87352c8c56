#pragma once
#include <vector>

#include "app/recipe/node_path.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// The keys of a loop; or those of any step, then its model's and its pattern's.
std::vector<Key> keys_of(Step& step);

/// The keys of the step's model alone, whose targets are to be read only.
std::vector<Key> model_keys(const Step& step);

/// The steps that have names, those in loops too.
std::vector<NamedStep> named_steps(const std::vector<Step>& steps, const std::string& path = "step");

/// Reads [[step]] into \p recipe, whose domain, materials and layers are read, and builds the steps' models.
/// \throws RecipeError.
void read_steps(const toml::table& root, Recipe& recipe);

}  // namespace sidewall::app
