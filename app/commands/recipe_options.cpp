#include "app/commands/recipe_options.hpp"

#include <fmt/format.h>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/text.hpp"
#include "app/recipe/node_path.hpp"
#include "app/recipe/notes.hpp"

namespace sidewall::app {

std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command) {
    auto options = std::make_shared<RecipeOptions>();
    add_option(command, "RECIPE", options->file, "FILE", "Recipe in TOML", {.required = true});
    add_repeated(
        command, "--set", options->overrides, "KEY=VALUE",
        "Change a key before the recipe is checked, e.g. step[0].duration=2, or step.etch.duration=2 of the step named etch; "
        "may be repeated");
    return options;
}

Recipe read_recipe(const RecipeOptions& options) {
    Recipe recipe = load_recipe(options.file, options.overrides);
    for (const std::string& note : notes_on(recipe))
        print_warning(fmt::format("{}: note: {}", options.file, note));
    return recipe;
}

std::filesystem::path default_output(const std::string& recipe_file,
                                     const std::vector<std::string>& overrides) {
    constexpr std::size_t kLongest = 100;
    std::filesystem::path folder =
        std::filesystem::path("results") / std::filesystem::path(recipe_file).stem();
    std::string all, name;
    for (const std::string& setting : overrides) {
        all += setting + '\n';
        name += ',';
        for (const char c : setting)  // "step[0].duration=2" becomes step.0.duration=2
            if (c == '[')
                name += '.';
            else if (c != ']')
                name += key_character(c) || c == '.' || c == '=' || c == ',' || c == '+' ? c : '_';
    }
    // Long names that begin alike differ by what all say together.
    return folder.concat(name.size() > kLongest ? name.substr(0, kLongest) + "-" + digest(all) : name);
}

}  // namespace sidewall::app
