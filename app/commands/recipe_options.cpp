#include "app/commands/recipe_options.hpp"

#include <fmt/format.h>

#include "app/commands/cli_options.hpp"
#include "app/recipe/notes.hpp"

namespace sidewall::app {

std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command) {
    auto options = std::make_shared<RecipeOptions>();
    add_option(command, "RECIPE", options->file, "FILE", "Recipe in TOML", {.required = true});
    add_repeated(command, "--set", options->overrides, "KEY=VALUE",
                 "Change a key before the recipe is checked, e.g. step[0].duration=2; may be repeated");
    return options;
}

Recipe read_recipe(const RecipeOptions& options) {
    Recipe recipe = load_recipe(options.file, options.overrides);
    for (const std::string& note : notes_on(recipe)) fmt::print(stderr, "{}: note: {}\n", options.file, note);
    return recipe;
}

std::filesystem::path default_output(const std::string& recipe_file) {
    return std::filesystem::path("results") / std::filesystem::path(recipe_file).stem();
}

}  // namespace sidewall::app
