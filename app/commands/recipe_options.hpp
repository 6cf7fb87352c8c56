#pragma once
#include <memory>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace CLI {
class App;
}

namespace sidewall::app {

/// What a command that takes a recipe was given.
struct RecipeOptions {
    std::string file;
    std::vector<std::string> overrides;
};

/// Adds the positional RECIPE and `--set key=value` to a subcommand.
std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command);

/// The recipe, changed as they say. Notes on it go to standard error.
Recipe load(const RecipeOptions& options);

}  // namespace sidewall::app
