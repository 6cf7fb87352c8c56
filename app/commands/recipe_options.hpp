#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace CLI {
class App;
}

namespace sidewall::app {

/// Recipe file and --set texts of a command line.
struct RecipeOptions {
    std::string file;
    std::vector<std::string> overrides;
};

/// Adds the positional RECIPE and `--set key=value` to a subcommand.
std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command);

/// Reads the recipe with its changes; prints notes on it to standard error.
Recipe read_recipe(const RecipeOptions& options);

/// Folder of results without -o: results/<recipe's name>, then the changes that --set makes, each after a comma, so that
/// trials of one recipe do not ask to be overwritten: results/trench,step.etch.duration=2.
std::filesystem::path default_output(const std::string& recipe_file,
                                     const std::vector<std::string>& overrides = {});

}  // namespace sidewall::app
