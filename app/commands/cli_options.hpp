#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

// What the commands need of CLI11. Its header costs most of a command's compile time, so only cli_options.cpp
// and the sources that read the whole command line (program, completion, man) include it. The type of an
// option's value says what a shell completes there: FILE or MESH (files), DIR (folders), MODEL (what
// `sidewall models` takes), KEY=... (recipe keys) or {this,that} (these words).
namespace sidewall::app {

/// A check on an option's value.
struct OptionRule {
    bool required = false;
    std::optional<std::array<double, 2>> range = {};  ///< least and largest number
    std::vector<std::string> one_of = {};
};

/// Adds a subcommand. Its options are added before `run_by`.
CLI::App& add_command(CLI::App& program, const std::string& name, const std::string& doc);

/// Sets what the subcommand does once its options are read.
void run_by(CLI::App& command, std::function<void()> run);

/// An option with a value, or a positional argument if \p names has no dashes.
/// \param value  a std::string, path, number, optional number, or a vector of strings, which takes all
///               that follow; unchanged where the option is not given.
/// \param type   stands for the value in --help and says what a shell completes there (above).
template <class T>
CLI::Option& add_option(CLI::App& command, const std::string& names, T& value, const std::string& type,
                        const std::string& doc, const OptionRule& rule = {});

/// An option that may be repeated and takes one value each time; \p values gets them in their order.
CLI::Option& add_repeated(CLI::App& command, const std::string& names, std::vector<std::string>& values,
                          const std::string& type, const std::string& doc);

/// `--threads N` (default: all cores); takes effect when the command line is parsed.
void add_threads_option(CLI::App& command);

/// An option without a value.
CLI::Option& add_flag(CLI::App& command, const std::string& names, bool& value, const std::string& doc);

/// Makes two options exclude each other.
void exclude(CLI::Option& one, CLI::Option& other);

/// Keeps the words of the program's command line for resume_command.
void note_command_line(int argc, char** argv);

/// The command that goes on with what this command line began: its own words, with --resume.
std::string resume_command();

}  // namespace sidewall::app
