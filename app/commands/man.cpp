#include <fmt/format.h>

#include <boost/algorithm/string/replace.hpp>

#include "app/commands/cli_options.hpp"
#include "app/common/version.hpp"
#include "app/recipe/sections.hpp"

namespace sidewall::app {
namespace {

/// Escapes text for roff; newlines become line breaks.
std::string roff(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if ((out.empty() || out.back() == '\n') && (c == '.' || c == '\'')) out += "\\&";
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else if (c == '\n')
            out += "\n.br\n";
        else
            out += c;
    }
    return out;
}

/// Prints \p text as a paragraph under \p tag; the tag must be escaped for roff already.
void print_tagged(const std::string& tag, const std::string& text) {
    fmt::print(".TP\n{}\n{}\n", tag, roff(text));
}

std::string tag_of(const CLI::Option& option) {
    std::string names;
    if (option.get_positional()) names = roff(option.get_name(true));
    for (const auto& [dashes, list] :
         {std::pair{"\\-", option.get_snames()}, {"\\-\\-", option.get_lnames()}})
        for (const std::string& name : list) names += (names.empty() ? "" : ", ") + (dashes + roff(name));
    std::string tag = "\\fB" + names + "\\fR";
    // The type of a positional argument repeats its name, unless it lists words.
    const std::string type = option.get_items_expected_max() == 0 ? "" : option.get_type_name();
    if (!type.empty() && (!option.get_positional() || type.find('{') != std::string::npos))
        tag += " \\fI" + boost::replace_all_copy(roff(type), ",", ",\\:") + "\\fR";  // lines may break there
    return tag;
}

void print_command(const CLI::App& command) {
    std::string usage = command.get_name() + " [OPTIONS]";
    const auto options = command.get_options();
    for (const CLI::Option* option : options) {
        if (!option->get_positional()) continue;
        const std::string name = option->get_name(true);
        usage += option->get_required() ? " " + name : " [" + name + "]";
    }
    fmt::print(".SS {}\n{}\n", roff(usage), roff(command.get_description()));
    for (const bool positional : {true, false})
        for (const CLI::Option* option : options)
            if (option->get_positional() == positional)
                print_tagged(tag_of(*option), option->get_description());
}

void print_recipe() {
    for (const SectionDoc& section : recipe_documentation()) {
        fmt::print(".SS {}\n{}\n", roff(section.header), roff(section.doc));
        for (const KeyDoc& key : section.keys)
            print_tagged(fmt::format("\\fB{}\\fR ({})", roff(key.name), roff(type_line(key))), key.doc);
        if (!section.more.empty()) fmt::print(".PP\n.nf\n{}.fi\n", roff(section.more));
    }
}

void print_page(const CLI::App& program) {
    fmt::print(".TH SIDEWALL 1 \"\" \"Sidewall {}\" \"User Commands\"\n.nh\n.ad l\n", version());
    fmt::print(".SH NAME\nsidewall \\- simulate etching and deposition of wafer surfaces\n");
    fmt::print(".SH SYNOPSIS\n\\fBsidewall\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR] ...\n");
    fmt::print(
        ".SH DESCRIPTION\n{}\n",
        roff(
            "Sidewall follows a wafer's surface as a level set while it is etched or coated as a recipe says, "
            "and traces the particles that arrive on it. `sidewall run RECIPE.toml` writes a folder of "
            "surfaces for ParaView, profiles, a timeline and a summary."));
    for (const CLI::Option* option : program.get_options())
        print_tagged(tag_of(*option), option->get_description());
    fmt::print(".SH COMMANDS\n");
    for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
        print_command(*command);
    fmt::print(
        ".SH RECIPES\n{}\n",
        roff("A recipe is a TOML file of these sections and keys; `sidewall models NAME` prints one of them. "
             "Lengths, times and rates are in the units that [domain] names."));
    print_recipe();
    fmt::print(".SH EXIT STATUS\n");
    for (const auto& [status, meaning] :
         {std::pair{"0", "success"},
          {"2", "wrong command line or recipe"},
          {"3", "an input file that is missing, damaged or of the wrong kind"},
          {"4", "no solution: not a number, no surface left, particles that leak, no memory"},
          {"5", "an output that could not be written"},
          {"130", "interrupted; what was finished is on disk, and `--resume` continues it"}})
        print_tagged(fmt::format("\\fB{}\\fR", status), meaning);
}

}  // namespace

void add_man_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "man",
        "Print a manual page of all commands and recipe keys: sidewall man > sidewall.1; man ./sidewall.1");
    command.callback([&program] { print_page(program); });
}

}  // namespace sidewall::app
