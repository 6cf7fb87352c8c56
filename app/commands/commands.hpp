#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

// One function a subcommand: adds it to the program, with its options and what it does. Each lives in
// app/commands/<name>.cpp.
namespace sidewall::app {

void add_run_command(CLI::App& program);
void add_check_command(CLI::App& program);
void add_models_command(CLI::App& program);
void add_compare_command(CLI::App& program);
void add_study_command(CLI::App& program);
void add_simplify_command(CLI::App& program);
void add_flux_command(CLI::App& program);
void add_inspect_command(CLI::App& program);
void add_render_command(CLI::App& program);

/// Adds `--threads N` (default: all cores) to a subcommand; takes effect when the command line is parsed.
void add_threads_option(CLI::App& command);

/// Where results go if no -o is given: results/<recipe's name>.
std::filesystem::path default_output(const std::string& recipe_file);

}  // namespace sidewall::app
