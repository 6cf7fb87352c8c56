#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace sidewall::app {

/// Arguments of a sweep, as the user wrote them.
struct SweepOptions {
    std::string recipe;                  ///< file
    std::vector<std::string> overrides;  ///< key=value, of all runs
    std::vector<std::string> vary;       ///< parse_vary
    std::string design = "grid";         ///< or "sobol"
    std::optional<std::size_t> runs;     ///< of Sobol's points
    std::vector<std::string> measures;   ///< besides those that the recipe names
    std::size_t jobs = 0;                ///< as in RunSet
    bool resume = false, quiet = false;
    std::filesystem::path output;
    std::string resume_command;
};

/// How a sweep ended.
struct SweepEnd {
    std::size_t rows = 0, runs = 0, failed = 0;  ///< points, different runs among them, and of these
    std::string table;                           ///< what DIR/sweep.csv holds
};

/// Runs a recipe at many values of its keys: DIR/sweep.json (what is varied, units), DIR/sweep.csv (a row a point,
/// whole after every run) and DIR/runs/NNNN. Every recipe is read and checked before the first run.
/// \throws RecipeError for what cannot be run; Interrupted; IoError; NumericsError if every run failed.
SweepEnd run_sweep(const SweepOptions& options);

/// Writes the folder of a sweep without making its runs.
/// \returns the commands that make these, one a line; `run_sweep` with `resume` gathers what they leave.
std::string plan_sweep(const SweepOptions& options);

}  // namespace sidewall::app
