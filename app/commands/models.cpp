#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/text.hpp"
#include "app/recipe/decks.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/step_materials.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

void print_section(const SectionDoc& section) {
    fmt::print("{}\n  {}\n", section.header, section.doc);
    for (const KeyDoc& key : section.keys) {
        fmt::print("  {:<18} {}", key.name, type_line(key));
        if (!key.doc.empty()) fmt::print("\n  {:<18} {}", "", key.doc);
        fmt::print("\n");
    }
    fmt::print("\n");
    if (section.more.empty()) return;
    for (const std::string& line : split(section.more, '\n'))
        fmt::print("{}{}\n", line.empty() ? "" : "  ", line);
}

void print_documentation(const std::string& name) {
    const std::vector<SectionDoc> sections = recipe_documentation();
    std::vector<std::string> names;
    bool found = false;
    for (const SectionDoc& section : sections) {
        names.push_back(section.name);
        // "layer" stands for the sections of all its shapes.
        if (!name.empty() && section.name != name && !section.name.starts_with(name + " ")) continue;
        print_section(section);
        if (section.name == "material") fmt::print("{}\n", built_in_materials());
        found = true;
    }
    if (!found) {
        throw RecipeError("models {}: no model or recipe section of that name{} `sidewall models` lists all",
                          name, did_you_mean(": ", name, names, ";"));
    }
}

// Lists all decks, or prints the file of the named one.
void print_chemistry(const std::string& name) {
    std::vector<std::string> names;
    for (const Deck& deck : shipped_decks()) {
        if (name.empty()) fmt::print("{:<26} {:<16} {}\n", deck.name, deck.model, deck.title);
        if (deck.name == name)
            fmt::print("# {}\n{}", deck.file.string(), surface::read_whole_file(deck.file));
        names.push_back(deck.name);
    }
    if (!name.empty() && std::ranges::count(names, name) == 0)
        throw RecipeError("models chemistry {}: none of that name{}", name, deck_advice(name, names));
}

}  // namespace

void add_models_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "models", "List every model and recipe key with type, unit and default, or chemistries");
    const auto name = std::make_shared<std::string>();
    add_option(
        command, "NAME", *name, "MODEL",
        "Only this model or section, e.g. single_particle or flux; chemistry: the decks that steps can name");
    const auto deck = std::make_shared<std::string>();
    add_option(command, "DECK", *deck, "CHEMISTRY",
               "After chemistry: print the file of this chemistry, with sources, ranges and rates");
    command.callback([name, deck] {
        if (*name == "chemistry")
            print_chemistry(*deck);
        else if (deck->empty())
            print_documentation(*name);
        else
            throw RecipeError("models {} {}: a second name follows chemistry only", *name, *deck);
    });
}

}  // namespace sidewall::app
