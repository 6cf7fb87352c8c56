#pragma once
#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/results/result.hpp"
#include "surface/error.hpp"

// Options of the commands. The type of an option's value says what a shell completes there: FILE or MESH
// (files), DIR (folders), MODEL (what `sidewall models` takes), KEY=... (recipe keys) or {this,that} (these
// words).
namespace sidewall::app {

/// A check on an option's value.
struct OptionRule {
    bool required = false;
    std::optional<std::array<double, 2>> range = {};  ///< least and largest number allowed
    std::vector<std::string> one_of = {};
};

/// An option with a value, or a positional argument if \p names has no dashes.
/// \param value  unchanged where the option is not given; a vector takes all that follow.
/// \param type   stands for the value in --help and says what a shell completes there (listed above).
template <class T>
CLI::Option& add_option(CLI::App& command, const std::string& names, T& value, const std::string& type,
                        const std::string& doc, const OptionRule& rule = {}) {
    const auto refuse_nan = [](const std::string& text) {  // NaN passes every range check
        return std::isnan(std::strtod(text.c_str(), nullptr)) ? text + ": must be a number" : "";
    };
    CLI::Option& option = *command.add_option(names, value, doc);
    option.required(rule.required);
    if (rule.range) option.check(refuse_nan, "")->check(CLI::Range((*rule.range)[0], (*rule.range)[1]));
    if (!rule.one_of.empty()) option.check(CLI::IsMember(rule.one_of));
    return *option.type_name(type);
}

/// An option that may be repeated and takes one value each time; \p values gets them in their order.
void add_repeated(CLI::App& command, const std::string& names, std::vector<std::string>& values,
                  const std::string& type, const std::string& doc);

/// `--threads N` (default: all cores); takes effect when the command line is parsed.
void add_threads_option(CLI::App& command);

/// Keeps the words of the program's command line for resume_command.
void note_command_line(int argc, char** argv);

/// The command that resumes this one: its words with --resume, without --overwrite and --quiet.
std::string resume_command();

/// Runs \p work; puts \p file before messages of GeometryError and NumericsError that do not begin with it.
template <class Work>
auto about(const std::string& file, Work&& work) {
    const auto named = [&](const Error& error) {
        const std::string text = error.what();
        return text.starts_with(file) ? text : file + ": " + text;
    };
    try {
        return work();
    } catch (const GeometryError& error) {
        throw GeometryError(named(error));
    } catch (const NumericsError& error) {
        throw NumericsError(named(error));
    }
}

/// Recipe file and --set texts of a command line.
struct RecipeOptions {
    std::string file;
    std::vector<std::string> overrides;
};

/// Adds the positional RECIPE and `--set key=value` to a subcommand.
std::shared_ptr<RecipeOptions> add_recipe_options(CLI::App& command);

/// The recipe of a file, or of standard input where the file is `-`, with its --set changes. Files that a
/// recipe on standard input names are sought in the working folder.
Recipe recipe_of(const RecipeOptions& options);

/// Reads the recipe of a file with its --set changes; prints notes on it to standard error.
Recipe read_recipe(const RecipeOptions& options);

/// Prints notes on a recipe to standard error, after the name of its file.
void print_notes(const Recipe& recipe, const std::string& file);

/// Folder of results without -o: results/<recipe's name>, then each --set change after a comma, as in
/// results/trench,step.etch.duration=2. Variants of one recipe thus do not overwrite each other.
std::filesystem::path default_output(const std::string& recipe_file,
                                     const std::vector<std::string>& overrides = {});

/// Choice of the wafer of a run that a command takes: the one at the end of a step, or the saved one nearest to a
/// time. Without either, the wafer at the end, or the last one that an unfinished run has reached.
struct WaferChoice {
    std::string step;
    std::optional<double> time;

    bool named() const { return time || !step.empty(); }
};

/// The options --step and --time, which exclude each other.
std::pair<CLI::Option*, CLI::Option*> add_choice_options(CLI::App& command, WaferChoice& choice);

/// The saved surface of a run's folder that \p choice names.
/// \throws RecipeError naming the choices; FileError if the folder has none.
SavedSurface saved_choice(const std::filesystem::path& folder, const WaferChoice& choice);

/// Reads a mesh file, or the chosen wafer of a run's folder. Without a choice, an unfinished run gives that
/// of its checkpoint, or a surface that was saved later.
/// \throws as read_result and saved_choice; RecipeError for a choice and a mesh file.
Result read_choice(const std::filesystem::path& input, const WaferChoice& choice);

/// A note that a folder's run has not ended; empty for an ended run and for a file.
std::string unfinished_note(const std::filesystem::path& input);

}  // namespace sidewall::app
