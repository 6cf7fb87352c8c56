#include "app/report/report.hpp"

#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"

namespace sidewall::app {
namespace {

struct ReportOptions {
    std::vector<std::string> inputs;
    std::string output, json;
    WaferChoice choice;
    bool last = false;
};

Report report_of(const ReportOptions& options) {
    const std::string& first = options.inputs.front();
    const bool recipe = first == "-" || first.ends_with(".toml"), one = options.inputs.size() == 1;
    if ((recipe || !one) && (options.choice.named() || options.last))
        throw RecipeError("{}: --step, --time and --last choose among the surfaces of one run", first);
    if (recipe && !one) throw RecipeError("{}: a recipe is reported alone", first);
    if (recipe) return about(first, [&] { return make_report(recipe_of({first, {}})); });
    if (!one) return make_report(std::vector<fs::path>(options.inputs.begin(), options.inputs.end()));
    if (options.choice.named()) return make_report(first, saved_choice(first, options.choice));
    if (options.last && is_there(fs::path(first) / "surface.pvd"))
        return make_report(first, saved_surfaces(first).back(), true);
    return make_report(first);
}

void report(const ReportOptions& options) {
    if (options.output.empty() == options.json.empty())
        throw RecipeError("report: give -o FILE.html or --json FILE, one of them");
    if (options.json.empty() && !options.output.ends_with(".html") && !options.output.ends_with(".htm"))
        throw RecipeError("-o {}: must end in .html", options.output);
    const Report page = report_of(options);
    if (options.json == "-") return print_plain("{}\n", page.data);
    write_file(options.output + options.json, options.json.empty() ? page.html : page.data);
    if (!options.json.empty()) return;
    print_plain("{}: page of a {}, {:.1f} MB", options.output, page.kind,
                static_cast<double>(page.html.size()) * 1e-6);
    if (page.surfaces > 0) print_plain(", {} surfaces", page.surfaces);
    print_plain("; open it in a browser\n");
}

}  // namespace

void add_report_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "report",
        "Put a folder of results on one page that opens in any browser, offline: 3-D view, charts, tables, recipe; several runs "
        "side by side; or the wafer that a recipe begins with");
    const auto options = std::make_shared<ReportOptions>();
    add_option(
        command, "input", options->inputs, "DIR|FILE",
        "Folder that `run`, `sweep`, `fit`, `compare`, `study` or `validate` wrote, finished or not; folders of several "
        "runs; or a recipe, - for one on standard input",
        {.required = true});
    add_option(
        command, "-o,--output", options->output, "FILE.html",
        "Page to write, at most 6 MB: surfaces are coarsened to fit, within an error that the page states");
    add_option(command, "--json", options->json, "FILE",
               "Write what the page would show as JSON instead; - for standard output");
    const auto [step, time] = add_choice_options(command, options->choice);
    command
        .add_flag("--last", options->last,
                  "For a run: its last surface alone, or the wafer of its checkpoint if that is later")
        ->excludes(step)
        ->excludes(time);
    command.callback([options] { report(*options); });
}

}  // namespace sidewall::app
