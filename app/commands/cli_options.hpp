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
    std::optional<std::array<double, 2>> range = {};  ///< least and largest number
    std::vector<std::string> one_of = {};
};

/// An option with a value, or a positional argument if \p names has no dashes.
/// \param value  unchanged where the option is not given; a vector takes all that follow.
/// \param type   stands for the value in --help and says what a shell completes there (above).
template <class T>
CLI::Option& add_option(CLI::App& command, const std::string& names, T& value, const std::string& type,
                        const std::string& doc, const OptionRule& rule = {}) {
    const auto refuse_nan = [](const std::string& text) {  // which no range excludes
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

/// The command that goes on with what this command line began: its own words, with --resume.
std::string resume_command();

/// Does \p work and puts the file's name before its errors of geometry and numerics, unless they begin with it.
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

/// The recipe in a file with its changes, or on standard input where the file is `-`; files that it names are then sought in the
/// working folder.
Recipe recipe_of(const RecipeOptions& options);

/// Reads the recipe of a file with its changes; prints notes on it to standard error.
Recipe read_recipe(const RecipeOptions& options);

/// Prints notes on a recipe to standard error, after the name of its file.
void print_notes(const Recipe& recipe, const std::string& file);

/// Folder of results without -o: results/<recipe's name>, then the changes that --set makes, each after a comma, so that
/// trials of one recipe do not ask to be overwritten: results/trench,step.etch.duration=2.
std::filesystem::path default_output(const std::string& recipe_file,
                                     const std::vector<std::string>& overrides = {});

// The choice of a wafer among those in a run's folder.
/// The wafer that --step and --time name; neither: the one as it is at the end, or as far as an unfinished run has come.
struct WaferChoice {
    std::string step;
    std::optional<double> time;

    bool named() const { return time || !step.empty(); }
};

/// The options --step and --time, which exclude each other.
std::pair<CLI::Option*, CLI::Option*> add_choice_options(CLI::App& command, WaferChoice& choice);

/// The surface that a choice names among those that a folder's run has saved.
/// \throws RecipeError naming the choices; FileError if the folder has none.
SavedSurface saved_choice(const std::filesystem::path& folder, const WaferChoice& choice);

/// Reads a mesh file, or the wafer of a choice from a run's folder. That of an unfinished run is its checkpoint's, unless a
/// surface was saved since.
/// \throws as read_result and saved_choice; RecipeError if a choice is named of a mesh file.
Result read_choice(const std::filesystem::path& input, const WaferChoice& choice);

/// What to say of a folder whose run has not ended; empty of one that has, and of a file.
std::string unfinished_note(const std::filesystem::path& input);

}  // namespace sidewall::app
