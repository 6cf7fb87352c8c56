#include "app/fit/fit.hpp"

#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/processes.hpp"
#include "app/fit/fit_report.hpp"
#include "app/sweep/run_set.hpp"

namespace sidewall::app {

void add_fit_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "fit",
        "Find the values of a recipe's keys at which it meets measured figures or profiles, with 95 % intervals");
    const auto options = std::make_shared<FitOptions>();
    const auto json = std::make_shared<std::string>();
    FitOptions& fit = *options;
    add_option(
        command, "RECIPE", fit.recipes, "FILE",
        "Recipe in TOML. Several are fitted together, as for one process in several geometries; a target, "
        "key or setting of one of them then begins with RECIPE: (the file's name without folder and .toml)",
        {.required = true});
    add_repeated(
        command, "--set", fit.overrides, "KEY=VALUE",
        "Change a key before the recipe is checked, e.g. step[0].duration=2; RECIPE:KEY=VALUE: of one of "
        "several recipes; may be repeated");
    add_repeated(
        command, "--vary", fit.vary, "KEY=LO:HI[:log]",
        "A key to fit within bounds, on a linear or logarithmic scale; the search begins at the recipe's "
        "value if it lies between them; shared by all recipes, or for one: RECIPE:KEY=...; may be repeated");
    add_repeated(
        command, "--target", fit.targets, "NAME=VALUE[+-SIGMA]",
        "A figure of the metrology, such as depth, cd_at_0.5 or step_coverage_bottom, in the recipe's "
        "units, and its standard deviation; with several recipes RECIPE:NAME=...; may be repeated");
    add_repeated(
        command, "--target-profile", fit.profiles, "FILE.csv[@TIME]",
        "Measured points x,z of the surface, or of a part of it, in the cut of [metrology], in any order, "
        "at a process time (default: the end); with several recipes RECIPE:FILE.csv; may be repeated");
    add_option(command, "--profile-sigma", fit.profile_sigma, "LENGTH",
               "Standard deviation of the points of the target profiles");
    add_option(command, "--profile-offset", fit.profile_offset, "",
               "Also fit a shift of the target profiles along these axes (default: none)",
               {.one_of = {"none", "x", "z", "xz"}});
    add_option(
        command, "--method", fit.method, "",
        "Search method (default: auto). gauss-newton: least squares with slopes estimated from the runs; "
        "auto: gauss-newton, then crs if several minima are found that miss the targets; crs: controlled "
        "random search first, which takes 100 runs and more; bobyqa: without slopes, for targets with kinks",
        {.one_of = {"auto", "gauss-newton", "bobyqa", "crs"}});
    add_option(
        command, "--max-runs", fit.max_runs, "N",
        "Most runs (default: 60); up to 6 of them, a quarter at most, measure the noise for the confidence "
        "intervals");
    add_option(
        command, "--jobs", fit.jobs, "J",
        "Runs at the same time (default: as many as threads); fewer where the memory does not hold them",
        {.range = {{1, 1024}}});
    command.add_flag("--resume", fit.resume, "Continue an earlier fit with the runs in the folder");
    command.add_flag("--quiet", fit.quiet, "No progress and no report");
    add_option(command, "--json", *json, "FILE",
               "Write fit.json here too; - for standard output, and then no report");
    add_option(command, "-o,--output", fit.output, "DIR", "Folder for results", {.required = true});
    command.callback([options, json] {
        FitOptions& fit = *options;
        fit.resume_command = resume_command();
        install_interrupt_handler();
        if (ranks().rank != 0) return help_with_runs(fit.output, fit.jobs);
        const Json found = run_fit(fit);
        if (!json->empty()) write_json(*json, found);
        if (!fit.quiet && *json != "-")
            print_plain("{}best recipe{}; all runs: {}\n", fit_table(found),
                        fit.recipes.size() == 1 ? ": " + (fit.output / "best.toml").string()
                                                : "s: " + (fit.output / "best_*.toml").string(),
                        (fit.output / "fit.csv").string());
    });
}

}  // namespace sidewall::app
