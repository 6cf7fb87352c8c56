#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/sweep/run_set.hpp"
#include "app/sweep/vary.hpp"

namespace sidewall::app {

/// Arguments of a sweep, as the user wrote them.
struct SweepOptions {
    std::string recipe;                  ///< file
    std::vector<std::string> overrides;  ///< key=value, for all runs
    std::vector<std::string> vary;       ///< as parse_vary() takes them
    std::string design = "grid";         ///< or "sobol"
    std::optional<std::size_t> runs;     ///< number of Sobol points
    std::vector<std::string> measures;   ///< besides those that the recipe names
    std::size_t jobs = 0;                ///< as in RunSet
    bool resume = false, quiet = false;
    std::filesystem::path output;
    std::string resume_command;
};

/// How a sweep ended.
struct SweepEnd {
    std::size_t rows = 0, runs = 0, failed = 0;  ///< points, different runs among them, failed ones
    std::string table;                           ///< content of DIR/sweep.csv
};

/// Runs a recipe at many values of its keys: DIR/sweep.json (what is varied, units), DIR/sweep.csv (a row a
/// point, whole after every run) and DIR/runs/NNNN. Every recipe is read and checked before the first run.
/// \throws RecipeError for what cannot be run; Interrupted; IoError; NumericsError if every run failed.
SweepEnd run_sweep(const SweepOptions& options);

/// Writes the folder of a sweep without making its runs.
/// \returns the commands that make the runs, one a line; run_sweep() with `resume` gathers their results.
std::string plan_sweep(const SweepOptions& options);

/// A point of a sweep or a fit.
struct RunPoint {
    RunValues values;        ///< of the varied keys
    std::size_t number = 0;  ///< of its run; equal points share one
};

/// The recipe \p text with \p overrides and then \p values set for \p keys.
/// \throws RecipeError naming the value that breaks a rule.
Recipe recipe_at(const std::string& text, const std::string& file, const std::vector<std::string>& overrides,
                 const std::vector<std::string>& keys, const RunValues& values);

/// An effective recipe with some keys changed.
/// \param file, overrides  the user's recipe from which it came, and the changes that the user asked for.
/// \throws RecipeError naming lines of the user's file, not of the effective recipe.
Recipe recipe_changed(const std::string& effective, const std::string& file,
                      const std::vector<std::string>& overrides, std::vector<std::string> changes);

/// CSV of the points whose runs have ended: run, keys, every figure of their metrology (empty where a run has
/// none), seconds, status. The order in which runs ended does not matter.
std::string run_table(const std::vector<std::string>& keys, const std::vector<RunPoint>& points,
                      const RunSet& set);

}  // namespace sidewall::app
