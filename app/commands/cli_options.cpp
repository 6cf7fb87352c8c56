#include "app/commands/cli_options.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>

#include "app/common/text.hpp"
#include "app/common/threads.hpp"

namespace sidewall::app {

CLI::App& add_command(CLI::App& program, const std::string& name, const std::string& doc) {
    return *program.add_subcommand(name, doc);
}

void run_by(CLI::App& command, std::function<void()> run) {
    command.callback(std::move(run));
}

namespace {

std::vector<std::string> command_line;  // without the program's name

// No range excludes "not a number".
std::string refuse_nan(const std::string& text) {
    return std::isnan(std::strtod(text.c_str(), nullptr)) ? text + ": must be a number" : "";
}

}  // namespace

template <class T>
CLI::Option& add_option(CLI::App& command, const std::string& names, T& value, const std::string& type,
                        const std::string& doc, const OptionRule& rule) {
    CLI::Option& option = *command.add_option(names, value, doc);
    option.required(rule.required);
    if (rule.range) option.check(refuse_nan, "")->check(CLI::Range((*rule.range)[0], (*rule.range)[1]));
    if (!rule.one_of.empty()) option.check(CLI::IsMember(rule.one_of));
    return *option.type_name(type);
}

using Text = const std::string&;
template CLI::Option& add_option(CLI::App&, Text, std::string&, Text, Text, const OptionRule&);
template CLI::Option& add_option(CLI::App&, Text, std::filesystem::path&, Text, Text, const OptionRule&);
template CLI::Option& add_option(CLI::App&, Text, double&, Text, Text, const OptionRule&);
template CLI::Option& add_option(CLI::App&, Text, std::optional<double>&, Text, Text, const OptionRule&);
template CLI::Option& add_option(CLI::App&, Text, std::optional<long long>&, Text, Text, const OptionRule&);
template CLI::Option& add_option(CLI::App&, Text, std::size_t&, Text, Text, const OptionRule&);
template CLI::Option& add_option(CLI::App&, Text, std::optional<std::size_t>&, Text, Text, const OptionRule&);
template CLI::Option& add_option(CLI::App&, Text, std::vector<std::string>&, Text, Text, const OptionRule&);

// Through a callback: CLI11 would take "[1,2]" apart.
CLI::Option& add_repeated(CLI::App& command, const std::string& names, std::vector<std::string>& values,
                          const std::string& type, const std::string& doc) {
    const auto take = [&values](const std::string& text) { values.push_back(text); };
    return *command.add_option_function<std::string>(names, take, doc)
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

CLI::Option& add_flag(CLI::App& command, const std::string& names, bool& value, const std::string& doc) {
    return *command.add_flag(names, value, doc);
}

void exclude(CLI::Option& one, CLI::Option& other) {
    one.excludes(&other);
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

}  // namespace sidewall::app
