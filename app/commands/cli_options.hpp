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

// What the commands need of CLI11, whose header only options.cpp and those who read the program's own table
// include: it is most of what a command costs to build.
namespace sidewall::app {

/// What an option's value must be.
struct OptionRule {
    bool required = false;
    std::optional<std::array<double, 2>> range = {};  ///< least and largest number
    std::vector<std::string> one_of = {};
};

/// Adds a subcommand. Its options are added before `run_by`.
CLI::App& add_command(CLI::App& program, const std::string& name, const std::string& doc);

/// What the subcommand does once its options are read.
void run_by(CLI::App& command, std::function<void()> run);

/// An option with a value, or a positional argument if \p names has no dashes.
/// \param value  a std::string, path, double, optional number, or a vector of strings, which takes all
///               that follow; keeps what it is where the option is not given.
/// \param type   stands for the value in --help and says what a shell completes there (commands.hpp).
template <class T>
CLI::Option& add_option(CLI::App& command, const std::string& names, T& value, const std::string& type,
                        const std::string& doc, const OptionRule& rule = {});

/// One that may be repeated: \p take gets each value as soon as it is read.
CLI::Option& add_repeated(CLI::App& command, const std::string& names,
                          const std::function<void(const std::string&)>& take, const std::string& type,
                          const std::string& doc);

/// `--threads N` (default: all cores); takes effect when the command line is parsed.
void add_threads_option(CLI::App& command);

/// An option without a value.
CLI::Option& add_flag(CLI::App& command, const std::string& names, bool& value, const std::string& doc);

/// The two may not be given together.
void exclude(CLI::Option& one, CLI::Option& other);

}  // namespace sidewall::app
