#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/evaluation/validate.hpp"
#include "app/evaluation/validate_cases.hpp"

namespace sidewall::app {
namespace {

struct ValidateArguments {
    ValidationOptions options{.output = "results/validation"};
    std::string json;
    bool list = false;
};

void print(const Json& one) {
    print_plain("{}: {} ({:.1f} s)\n", one["name"], one["title"], one["seconds"]);
    for (const Json& reading : one["readings"])
        print_plain("  {:<38} {:>9.5g}  reference {:>9.5g}  {:>7.5g} %  {}\n", reading["label"],
                    reading["ours"], reading["reference"], reading["deviation_percent"],
                    reading["role"] == "fitted"          ? "fitted"
                    : reading["within_bars"].get<bool>() ? "within the bars"
                                                         : "outside of the bars");
    std::fflush(stdout);
}

void run(const ValidateArguments& arguments) {
    ValidationOptions options = arguments.options;
    if (options.folder.empty()) options.folder = shipped_cases();
    if (arguments.list) {
        for (const ValidationCase& one : validation_cases(options.folder))
            print_plain("{:<22} {}\n", one.name, one.title);
        return;
    }
    options.resume_command = resume_command();
    const bool quiet = arguments.json == "-";
    if (!quiet) options.finished = print;
    install_interrupt_handler();
    const Json validation = validate(options);
    if (!arguments.json.empty()) write_json(arguments.json, validation);
    if (!quiet) print_plain("report in {}\n", (options.output / "validation.md").string());
}

}  // namespace

void add_validate_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "validate",
        "Compare figures of runs with closed forms, published tables and another simulator, each with its "
        "source and error bars");
    const auto a = std::make_shared<ValidateArguments>();
    add_repeated(command, "--case", a->options.cases, "NAME",
                 "Only this case; the report keeps the figures of the others; may be repeated (default: "
                 "all)");
    add_option(
        command, "--cases", a->options.folder, "DIR",
        "Folder of cases, each a folder with recipe.toml and reference.csv (default: those that come with the program)");
    command.add_flag("--list", a->list, "List the cases, run nothing");
    add_option(
        command, "-o,--output", a->options.output, "DIR",
        "Folder for the report validation.md, validation.json and the runs (default: results/validation)");
    add_option(command, "--history", a->options.history, "FILE",
               "Also add the figures to this CSV file, which holds those of other versions, too");
    CLI::Option& resume =
        *command.add_flag("--resume", a->options.resume,
                          "Continue after an interruption: finished runs of the same recipes and version "
                          "are not made again");
    command.add_flag("--overwrite", a->options.overwrite, "Replace other runs in the folder")
        ->excludes(&resume);
    add_option(command, "--json", a->json, "FILE", "Also write the figures there; - for standard output");
    command.callback([a] { run(*a); });
}

}  // namespace sidewall::app
