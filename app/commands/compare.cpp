#include "app/evaluation/compare.hpp"

#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"

namespace sidewall::app {
namespace {

struct CompareArguments {
    std::string output, json;
    bool overwrite = false;
};

}  // namespace

void add_compare_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "compare",
        "Run a recipe without and with each method of mesh simplification, and compare run time and error");
    const auto recipe = add_recipe_options(command);
    const auto arguments = std::make_shared<CompareArguments>();
    add_option(command, "-o,--output", arguments->output, "DIR",
               "Folder for results (default: results/<recipe>-compare; with --set "
               "results/<recipe>,KEY=VALUE-compare)");
    command.add_flag("--overwrite", arguments->overwrite, "Replace other runs in the folder");
    add_option(command, "--json", arguments->json, "FILE",
               "Also write the comparison there; - for standard output");
    command.callback([recipe, arguments] {
        const Recipe parsed = read_recipe(*recipe);
        const std::filesystem::path output =
            arguments->output.empty() ? default_output(recipe->file, recipe->overrides).concat("-compare")
                                      : std::filesystem::path(arguments->output);
        const bool quiet = arguments->json == "-";
        install_interrupt_handler();
        const Json comparison = compare_methods(parsed, output, quiet, arguments->overwrite);
        if (!arguments->json.empty()) write_json(arguments->json, comparison);
        if (quiet) return;
        print_plain(
            "{}\ndistance: of the final surface from the raw run's, in grid spacings of {:.4g} {}; noise "
            "floor: raw with another seed\nresults in {}\n",
            compare_table(comparison), comparison["grid_spacing"], comparison["length_unit"],
            output.string());
    });
}

}  // namespace sidewall::app
