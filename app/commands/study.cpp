#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/evaluation/study.hpp"

namespace sidewall::app {
namespace {

struct StudyArguments {
    StudyOptions options{.output = "results/study", .recipes = "configs/study"};
    std::string surface = "all", grid_levels, json;
    bool quick = false;
};

void run(const StudyArguments& arguments) {
    StudyOptions options = arguments.options;
    if (arguments.surface != "all") options.surfaces = {arguments.surface == "1" ? 1 : 2};
    if (!arguments.grid_levels.empty()) options.grid_levels = arguments.grid_levels[0] - '0';
    if (arguments.quick) options.removals = {0.5, 0.9};
    options.quiet = arguments.json == "-";
    install_interrupt_handler();
    const Json study = run_study(options);
    if (!arguments.json.empty()) write_json(arguments.json, study);
    if (!options.quiet) print_plain("{}\nresults in {}\n", study_report(study), options.output.string());
}

}  // namespace

void add_study_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "study",
        "Redo the evaluation of region simplification (Lenz 2023, section 8.3) on surfaces grown here:\n"
        "distance, simplification time and tracing time at equal numbers of vertices.");
    const auto a = std::make_shared<StudyArguments>();
    add_option(command, "-o,--output", a->options.output, "DIR",
               "Folder for results (default: results/study)");
    add_option(command, "--surface", a->surface, "N", "1 (low relief), 2 (deep hole) or all (default: all)",
               {.one_of = {"1", "2", "all"}});
    add_option(command, "--recipes", a->options.recipes, "DIR",
               "Folder with surface1.toml and surface2.toml (default: configs/study)");
    add_option(command, "--grid-levels", a->grid_levels, "N",
               "Levels of the grid that the surfaces are grown on, 1 to 3 (default: as the recipes say)",
               {.one_of = {"1", "2", "3"}});
    add_option(command, "--rays", a->options.rays, "N", "Source rays of every timed trace (default: 1e7)",
               {.range = {{1e3, 1e10}}});
    add_option(command, "--sticking", a->options.sticking, "S",
               "Sticking probability of the traced neutral (default: 0.1)", {.range = {{1e-3, 1.0}}});
    command.add_flag("--quick", a->quick, "Only 50 and 90 % of the vertices removed instead of 20 to 90 %");
    command.add_flag("--overwrite", a->options.overwrite, "Replace other runs in the folder");
    add_option(command, "--json", a->json, "FILE", "Also write the study there; - for standard output");
    command.callback([a] { run(*a); });
}

}  // namespace sidewall::app
