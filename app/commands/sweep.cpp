#include "app/sweep/sweep.hpp"

#include <fmt/ranges.h>

#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/processes.hpp"
#include "app/recipe/figure_names.hpp"

namespace sidewall::app {
namespace {

void print_end(const SweepOptions& sweep, const SweepEnd& end) {
    print_plain("{} rows of {} runs in {}", end.rows, end.runs, (sweep.output / "sweep.csv").string());
    if (end.failed > 0)
        print_plain(", {} failed: see the column status; --resume tries them again", end.failed);
    print_plain("\n");
}

}  // namespace

void add_sweep_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "sweep", "Run a recipe at many values of its keys, side by side, into one table: sweep.csv");
    const auto recipe = add_recipe_options(command);
    const auto options = std::make_shared<SweepOptions>();
    const auto plan = std::make_shared<bool>(false);
    SweepOptions& sweep = *options;
    add_repeated(command, "--vary", sweep.vary, "KEY=LO:HI[:N][:log]|KEY=V1,V2,...",
                 "A key and its values: N from LO to HI, evenly or logarithmically spaced, or a list; may "
                 "be repeated, and then all combinations are run");
    add_option(command, "--design", sweep.design, "",
               "All combinations (grid, the default), or --runs points that fill the ranges evenly (sobol)",
               {.one_of = {"grid", "sobol"}});
    add_option(command, "--runs", sweep.runs, "N", "Number of points of the design sobol");
    add_repeated(
        command, "--measure", sweep.measures, fmt::format("{{{}}}", fmt::join(measure_names(), ",")),
        "Measure this, too: a word of [metrology] measures, or a figure such as cd_at_0.5; may be repeated");
    add_option(
        command, "--jobs", sweep.jobs, "J",
        "Runs at the same time, each with an equal part of the --threads (default: as many as threads); "
        "fewer where the memory does not hold them",
        {.range = {{1, 1024}}});
    command.add_flag("--resume", sweep.resume,
                     "Complete an earlier sweep: unfinished runs continue, failed ones are tried again");
    command.add_flag(
        "--plan", *plan,
        "Run nothing: write the runs' recipes and print a command for each, as for a job array; afterwards "
        "--resume collects the results");
    command.add_flag("--quiet", sweep.quiet, "No progress and no report");
    add_option(command, "-o,--output", sweep.output, "DIR", "Folder for results", {.required = true});
    command.callback([recipe, options, plan] {
        SweepOptions& sweep = *options;
        sweep.recipe = recipe->file;
        sweep.overrides = recipe->overrides;
        sweep.resume_command = resume_command();
        if (*plan) {
            if (ranks().rank != 0) return;
            fmt::print("{}", plan_sweep(sweep));
            return;
        }
        install_interrupt_handler();
        if (ranks().rank != 0) return help_with_runs(sweep.output, sweep.jobs);
        const SweepEnd end = run_sweep(sweep);
        if (!sweep.quiet) print_end(sweep, end);
    });
}

}  // namespace sidewall::app
