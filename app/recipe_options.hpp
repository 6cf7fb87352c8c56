#pragma once
#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

namespace sidewall::app {

/// What a command that takes a recipe was given.
struct RecipeOptions {
    std::string file;
    std::vector<std::string> overrides;
};

/// Adds the positional RECIPE and `--set key=value` to a subcommand.
std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command);

}  // namespace sidewall::app
