#include "app/report/report.hpp"

#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"

namespace sidewall::app {
namespace {

void report(const std::string& folder, const std::string& output, const WaferChoice& choice) {
    if (!output.ends_with(".html") && !output.ends_with(".htm"))
        throw RecipeError("-o {}: must end in .html", output);
    std::optional<SavedSurface> only;
    if (choice.named()) only = saved_choice(folder, choice);
    const Report page = make_report(folder, only);
    write_file(output, page.html);
    print_plain("{}: page of a {}, {:.1f} MB", output, page.kind,
                static_cast<double>(page.html.size()) * 1e-6);
    if (page.surfaces > 0) print_plain(", {} surfaces", page.surfaces);
    print_plain("; open it in a browser\n");
}

}  // namespace

void add_report_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "report",
        "Put a folder of results on one page that opens in any browser, offline: 3-D view, charts, tables, recipe");
    auto folder = std::make_shared<std::string>(), output = std::make_shared<std::string>();
    add_option(command, "input", *folder, "DIR",
               "Folder that `run`, `sweep`, `fit`, `compare`, `study` or `validate` wrote, finished or not",
               {.required = true});
    add_option(
        command, "-o,--output", *output, "FILE.html",
        "Page to write, at most 6 MB: surfaces are coarsened to fit in, by a bound that the page states",
        {.required = true});
    auto choice = std::make_shared<WaferChoice>();
    add_choice_options(command, *choice);
    command.callback([folder, output, choice] { report(*folder, *output, *choice); });
}

}  // namespace sidewall::app
