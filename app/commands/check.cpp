#include <fmt/format.h>

#include "app/commands/commands.hpp"
#include "app/commands/recipe_options.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/step_materials.hpp"

namespace sidewall::app {

void add_check_command(CLI::App& program) {
    CLI::App* command = program.add_subcommand(
        "check", "Parse and validate a recipe and print it with every default; run nothing");
    const auto options = add_recipe_options(*command);
    command->callback([options] {
        const Recipe recipe = load(*options);
        const levelset::Domain domain = domain_of(recipe);
        fmt::print("{}# The grid: {} x {} cells of {} {}.\n{}", effective_recipe(recipe), domain.cells[0],
                   domain.cells[1], domain.spacing, recipe.domain.length_unit, values_by_material(recipe));
    });
}

}  // namespace sidewall::app
