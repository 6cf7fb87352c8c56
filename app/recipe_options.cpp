#include "app/recipe_options.hpp"

namespace sidewall::app {

std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command) {
    auto options = std::make_shared<RecipeOptions>();
    command.add_option("RECIPE", options->file, "Recipe in TOML")->required();
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

}  // namespace sidewall::app
