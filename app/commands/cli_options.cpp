#include "app/commands/cli_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <iterator>

#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/processes.hpp"
#include "app/common/text.hpp"
#include "app/process/estimate/blanket.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/schema/keys.hpp"

namespace sidewall::app {
namespace {

std::vector<std::string> command_line;  // without the program's name

}  // namespace

// A callback gets each value whole. CLI11 splits "[1,2]" when it fills a vector itself.
void add_repeated(CLI::App& command, const std::string& names, std::vector<std::string>& values,
                  const std::string& type, const std::string& doc) {
    const auto take = [&values](const std::string& text) { values.push_back(text); };
    command.add_option_function<std::string>(names, take, doc)
        ->type_name(type)
        ->multi_option_policy(CLI::MultiOptionPolicy::Throw)
        ->trigger_on_parse();
}

void add_threads_option(CLI::App& command) {
    command
        .add_option_function<int>("--threads", limit_threads,
                                  "Threads to use; results do not depend on it (default: all cores)")
        ->check(CLI::Range(1, 1024))
        ->trigger_on_parse()
        ->type_name("N");
}

void note_command_line(int argc, char** argv) {
    command_line.assign(argv + 1, argv + argc);
}

std::string resume_command() {
    std::string command = "sidewall";
    for (const std::string& word : command_line)
        if (word != "--overwrite" && word != "--quiet" && word != "--resume")
            command += " " + shell_word(word);
    return command + " --resume";
}

std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command) {
    auto options = std::make_shared<RecipeOptions>();
    add_option(command, "RECIPE", options->file, "FILE", "Recipe in TOML", {.required = true});
    add_repeated(
        command, "--set", options->overrides, "KEY=VALUE",
        "Change a key before the recipe is checked, e.g. step[0].duration=2, or step.etch.duration=2 for "
        "the step named etch; may be repeated");
    return options;
}

Recipe recipe_of(const RecipeOptions& options) {
    if (options.file != "-") return load_recipe(options.file, options.overrides);
    const std::string text{std::istreambuf_iterator<char>(std::cin), {}};
    return parse_recipe(text, "recipe", options.overrides);
}

Recipe read_recipe(const RecipeOptions& options) {
    Recipe recipe = load_recipe(options.file, options.overrides);
    print_notes(recipe, options.file);
    return recipe;
}

void print_notes(const Recipe& recipe, const std::string& file) {
    for (const std::string& note : notes_before_run(recipe))
        print_warning(fmt::format("{}: note: {}", file, note));
}

fs::path default_output(const std::string& recipe_file, const std::vector<std::string>& overrides) {
    constexpr std::size_t kLongest = 100;
    fs::path folder = fs::path("results") / fs::path(recipe_file).stem();
    std::string all, name;
    for (const std::string& setting : overrides) {
        all += setting + '\n';
        name += ',';
        for (const char c : setting)  // "step[0].duration=2" becomes step.0.duration=2
            if (c == '[')
                name += '.';
            else if (c != ']')
                name += key_character(c) || c == '.' || c == '=' || c == ',' || c == '+' ? c : '_';
    }
    // A shortened name ends in a digest of all settings, so that it still differs from others.
    return folder.concat(name.size() > kLongest ? name.substr(0, kLongest) + "-" + digest(all) : name);
}

std::pair<CLI::Option*, CLI::Option*> add_choice_options(CLI::App& command, WaferChoice& choice) {
    CLI::Option& step = add_option(
        command, "--step", choice.step, "NAME",
        "For a run's folder: the wafer at the end of this step, by its name or number; for a step in a "
        "loop, after its last repeat");
    CLI::Option& time =
        add_option(command, "--time", choice.time, "T",
                   "For a run's folder: the saved surface nearest to this process time, in the recipe's "
                   "unit (default: the last)");
    step.excludes(&time);
    return {&step, &time};
}

SavedSurface saved_choice(const fs::path& folder, const WaferChoice& choice) {
    const std::vector<SavedSurface> saved = saved_surfaces(folder);
    return choice.time ? saved_at(saved, *choice.time) : saved_after(saved, choice.step);
}

Result read_choice(const fs::path& input, const WaferChoice& choice) {
    if (choice.named() && is_there(input) && !fs::is_directory(input))
        throw RecipeError("{}: {} chooses among the surfaces of a run: name the folder that `run` wrote",
                          input.string(), choice.time ? "--time" : "--step");
    if (choice.named()) return read_saved(input, saved_choice(input, choice));
    if (!unfinished_note(input).empty())
        if (auto reached = wafer_of_checkpoint(input)) return *std::move(reached);
    return read_result(input);
}

std::string unfinished_note(const fs::path& input) {
    std::error_code failure;
    if (!fs::is_directory(input, failure) || is_there(input / "summary.json")) return {};
    return fmt::format("{}: the run has not ended: this is how far it has come", input.string());
}

}  // namespace sidewall::app
