#include <fmt/format.h>

#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/evaluation/validate.hpp"
#include "app/evaluation/validate_cases.hpp"

namespace sidewall::app {
namespace {

struct ValidateArguments {
    std::string output = "results/validation", folder, json;
    std::vector<std::string> cases;
    bool list = false, overwrite = false, resume = false;
};

std::string figure(const Json& number) {
    return number.is_number() ? fmt::format("{:.5g}", number.get<double>()) : "none";
}

void print(const Json& one) {
    fmt::print("{}: {} ({:.1f} s)\n", one["name"].get<std::string>(), one["title"].get<std::string>(),
               one["seconds"].get<double>());
    for (const Json& reading : one["readings"])
        fmt::print("  {:<38} {:>9}  reference {:>9}  {:>7} %  {}\n", reading["label"].get<std::string>(),
                   figure(reading["ours"]), figure(reading["reference"]),
                   figure(reading["deviation_percent"]),
                   reading["within_bars"].get<bool>() ? "within the bars" : "outside of the bars");
    std::fflush(stdout);
}

void run(const ValidateArguments& arguments) {
    const std::filesystem::path folder =
        arguments.folder.empty() ? shipped_cases() : std::filesystem::path(arguments.folder);
    if (arguments.list) {
        for (const ValidationCase& one : validation_cases(folder))
            fmt::print("{:<22} {}\n", one.name, one.title);
        return;
    }
    ValidationOptions options;
    options.folder = folder;
    options.output = arguments.output;
    options.cases = arguments.cases;
    options.overwrite = arguments.overwrite;
    options.resume = arguments.resume;
    options.resume_command = "sidewall validate -o " + shell_word(arguments.output);
    if (!arguments.folder.empty()) options.resume_command += " --cases " + shell_word(arguments.folder);
    for (const std::string& name : arguments.cases) options.resume_command += " --case " + name;
    options.resume_command += " --resume";
    const bool quiet = arguments.json == "-";
    if (!quiet) options.finished = print;
    install_interrupt_handler();
    const Json validation = validate(options);
    if (!arguments.json.empty()) write_json(arguments.json, validation);
    if (!quiet) fmt::print("report in {}\n", (options.output / "validation.md").string());
}

}  // namespace

void add_validate_command(CLI::App& program) {
    CLI::App& command = add_command(
        program, "validate",
        "Compare figures of runs with closed forms, published tables and another simulator, each with its source and bars");
    const auto a = std::make_shared<ValidateArguments>();
    add_repeated(command, "--case", a->cases, "NAME",
                 "Only this case, the report keeps the others' figures; may be repeated (default: all)");
    add_option(
        command, "--cases", a->folder, "DIR",
        "Folder of cases, each a folder with recipe.toml and reference.csv (default: those that come with the program)");
    add_flag(command, "--list", a->list, "List the cases, run nothing");
    add_option(
        command, "-o,--output", a->output, "DIR",
        "Folder for the report validation.md, validation.json and the runs (default: results/validation)");
    CLI::Option& resume =
        add_flag(command, "--resume", a->resume,
                 "Go on after an interruption: runs that are there, of the same recipes and "
                 "version, are not made again");
    exclude(add_flag(command, "--overwrite", a->overwrite, "Replace other runs in the folder"), resume);
    add_option(command, "--json", a->json, "FILE", "Also write the figures there; - for standard output");
    run_by(command, [a] { run(*a); });
}

}  // namespace sidewall::app
