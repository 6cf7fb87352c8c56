#pragma once
#include <vector>

#include "app/recipe/node_path.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Keys of a loop; or the keys common to all steps, then those of the step's model and pattern.
std::vector<Key> keys_of(Step& step);

/// Keys of the step's model alone. Only read their targets.
std::vector<Key> model_keys(const Step& step);

/// All steps with a name, including those in loops.
std::vector<NamedStep> named_steps(const std::vector<Step>& steps, const std::string& path = "step");

/// Reads [[step]] into \p recipe and builds the steps' models. \pre domain, materials and layers are read.
/// \throws RecipeError.
void read_steps(const toml::table& root, Recipe& recipe);

}  // namespace sidewall::app
