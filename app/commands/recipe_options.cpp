#include "app/commands/recipe_options.hpp"

#include <fmt/format.h>

namespace sidewall::app {

std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command) {
    auto options = std::make_shared<RecipeOptions>();
    command.add_option("RECIPE", options->file, "Recipe in TOML")->required()->type_name("FILE");
    // Through a callback: CLI11 would take "[1,2]" apart.
    command
        .add_option_function<std::string>(
            "--set", [options](const std::string& setting) { options->overrides.push_back(setting); },
            "Change a key before the recipe is checked, e.g. step[0].duration=2; may be repeated")
        ->type_name("KEY=VALUE")
        ->multi_option_policy(CLI::MultiOptionPolicy::Throw)
        ->trigger_on_parse();
    return options;
}

Recipe load(const RecipeOptions& options) {
    Recipe recipe = load_recipe(options.file, options.overrides);
    for (const std::string& note : notes_on(recipe)) fmt::print(stderr, "{}: note: {}\n", options.file, note);
    return recipe;
}

}  // namespace sidewall::app
