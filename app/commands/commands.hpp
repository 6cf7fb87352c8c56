#pragma once
#include <filesystem>
#include <string>

#include "app/commands/cli_options.hpp"

// One function a subcommand: adds it to the program, with its options and what it does. Each lives in
// app/commands/<name>.cpp. The type of an option's value says what a shell completes there: FILE or MESH
// (files), DIR (folders), MODEL (what `sidewall models` takes), KEY=... (recipe keys) or {this,that} (these
// words).
namespace sidewall::app {

void add_run_command(CLI::App& program);
void add_check_command(CLI::App& program);
void add_models_command(CLI::App& program);
void add_compare_command(CLI::App& program);
void add_study_command(CLI::App& program);
void add_validate_command(CLI::App& program);
void add_sweep_command(CLI::App& program);
void add_fit_command(CLI::App& program);
void add_simplify_command(CLI::App& program);
void add_flux_command(CLI::App& program);
void add_inspect_command(CLI::App& program);
void add_render_command(CLI::App& program);
void add_report_command(CLI::App& program);
void add_export_command(CLI::App& program);
void add_completion_command(CLI::App& program);
void add_man_command(CLI::App& program);

/// The whole program: puts the subcommands together, reads the command line, and says what went wrong.
/// \return the exit code
int run_program(int argc, char** argv);

/// Where results go if no -o is given: results/<recipe's name>.
std::filesystem::path default_output(const std::string& recipe_file);

}  // namespace sidewall::app
