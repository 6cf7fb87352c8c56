#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "app/accuracy/accuracy.hpp"
#include "app/accuracy/accuracy_bars.hpp"
#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/processes.hpp"
#include "app/common/text.hpp"
#include "app/process/simulation.hpp"
#include "app/recipe/notes.hpp"

namespace sidewall::app {
namespace {

void print_report(const RunResult& result, const RunOptions& options) {
    const Json& s = result.summary;
    const std::string time = s["time_unit"];
    print_plain("{} {} of process in {} time steps, {} triangles traced of {} extracted\n", s["time"], time,
                s["time_steps"], s["mesh"]["simplified"]["triangles"], s["mesh"]["raw"]["triangles"]);
    if (const Json& levels = s["grid"]["levels"]; levels.size() > 1)
        for (const Json& level : levels)
            print_plain("  {:<20} {:.3g} voxels\n",
                        fmt::format("grid of {:.4g} {}", level["spacing"], s["length_unit"]),
                        level["voxels"]);
    if (s.contains("accuracy"))
        print_plain("{}", accuracy_table(s));
    else
        for (const auto& [name, value] : s["metrology"].items())
            print_plain("  {:<20} {}\n", name,
                        value.is_null()
                            ? "none"
                            : fmt::format("{:.5g} {}", value.get<double>(), s["metrology_units"][name]));
    if (s.contains("noise"))
        print_plain("noise leaves about {:.1g} % in what a step moves ({:.2g} % asked for)\n",
                    100.0 * s["noise"]["reached"].get<double>(), 100.0 * s["noise"]["asked"].get<double>());
    print_plain("  {:<12} {:>9}  {:>5}\n", "phase", "seconds", "share");
    const Json timing = result.timing;
    for (const auto& [name, seconds] : timing.items())
        print_plain("  {:<12} {:>9.2f}  {:>4.0f}%\n", name, seconds,
                    100.0 * seconds.get<double>() / result.timing.total);
    if (s.contains("ranks"))
        print_plain("  {} ranks; {:.2f} s went into sums over them, waiting included\n", s["ranks"]["count"],
                    s["ranks"]["seconds_in_sums"]);
    print_plain("results in {} (open surface.pvd in ParaView, or: sidewall render {} -o picture.png)\n",
                options.output.string(), shell_word(options.output.string()));
}

// Shares the run with the other processes that mpirun has started.
void share_run(RunOptions& options, const std::vector<AskedAccuracy>& asked) {
    if (!asked.empty())
        throw RecipeError(
            "--accuracy: is work for one process: start it without mpirun, or run at a given spacing");
    options.shares = join_ranks();
    options.processes_here = ranks().on_this_machine;
    options.stop = any_rank_interrupted;
}

}  // namespace

void add_run_command(CLI::App& program) {
    CLI::App& command =
        *program.add_subcommand("run", "Run a recipe and write surfaces, profiles, timeline and summary");
    const auto recipe = add_recipe_options(command);
    const auto options = std::make_shared<RunOptions>();
    add_option(
        command, "-o,--output", options->output, "DIR",
        "Folder for results (default: results/<recipe>; with --set results/<recipe>,KEY=VALUE, so that trials stand side by side)");
    CLI::Option& resume = *command.add_flag(
        "--resume", options->resume,
        "Continue from the folder's checkpoint; a finished run continues if its last step was made longer "
        "or steps were added");
    command
        .add_flag("--overwrite", options->overwrite,
                  "Replace an unfinished run or another recipe's result in the folder")
        ->excludes(&resume);
    add_option(
        command, "--checkpoint-every", options->checkpoint_every, "N",
        "Write a checkpoint after every N time steps, too: less is lost if the run is killed, and `report "
        "--last` and the workbench show its progress (default: with every saved surface)");
    command.add_flag("--quiet", options->quiet,
                     "Print no progress, no events and no report; summary.json has them all");
    const auto accuracy = std::make_shared<std::vector<std::string>>();
    add_repeated(
        command, "--accuracy", *accuracy, "MEASURE=BOUND[%]",
        "Refine grid, rays and simplification until a figure such as depth or cd_at_0.5 is known to this bound, in its unit or "
        "in percent of its value, and state the error bars of all figures; may be repeated");
    const auto json = std::make_shared<std::string>();
    add_option(command, "--json", *json, "FILE",
               "Write summary.json here too; - for standard output, and then no report");
    command.callback([recipe, options, accuracy, json] {
        Recipe parsed = read_recipe(*recipe);
        const std::vector<AskedAccuracy> asked = read_accuracy(*accuracy, parsed);
        if (options->output.empty()) {
            options->output = default_output(recipe->file, recipe->overrides);
            // --resume with --set: if no folder is named after these changes, resume the recipe's folder.
            std::error_code failure;
            if (options->resume && !std::filesystem::exists(options->output, failure))
                options->output = default_output(recipe->file);
        }
        options->title = std::filesystem::path(recipe->file).stem().string();
        options->resume_command = resume_command();
        if (!options->quiet) {
            options->warn = print_warning;
            if (const std::string note = cheaper_form(parsed); !note.empty() && ranks().rank == 0)
                print_warning(fmt::format("{}: note: {}", recipe->file, note));
        }
        install_interrupt_handler();
        if (ranks().count > 1) share_run(*options, asked);
        const RunResult result = about(recipe->file, [&] {
            return asked.empty() ? run_recipe(parsed, *options)
                                 : run_to_accuracy(parsed, recipe->overrides, asked, *options);
        });
        if (!json->empty() && ranks().rank == 0) write_json(*json, result.summary);
        if (!options->quiet && *json != "-") print_report(result, *options);
    });
}

}  // namespace sidewall::app
