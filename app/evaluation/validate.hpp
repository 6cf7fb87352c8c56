#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

/// What of a folder of cases is run, and where its results go.
struct ValidationOptions {
    std::filesystem::path folder{};  ///< of the cases
    std::filesystem::path output;
    std::vector<std::string> cases{};  ///< names; empty: all
    std::filesystem::path history{};  ///< CSV of all versions' figures, whose rows of these cases and version
                                      ///< are written anew; empty: none
    bool overwrite = false;           ///< as in RunOptions
    bool resume = false;           ///< runs of the same recipes and version that are there are not made again
    std::string resume_command{};  ///< as in RunOptions
    std::function<void(const Json&)> finished{};  ///< called with each case as it ends
};

/// Runs cases (validate_cases.hpp). Each is run with all settings of its rows, on its grid, with another seed if it traces, and on twice the spacing: the bar
/// of a figure is the sum of both differences, which for a scheme of first order estimates grid and noise; of lengths at least
/// a tenth of the grid spacing.
///
/// Writes DIR/{validation.json, validation.md}, a chart of each case into DIR/validation/NAME.svg and the runs into DIR/NAME,
/// NAME-seed and NAME-coarse, of further settings into NAME-2 and so on. Cases that are not run keep the rows that the report has
/// of them, if their files are still the same.
/// \returns what validation.json holds.
/// \throws RecipeError for an unknown case; FileError for a validation.json that is none; what validation_cases, case_recipe and
///         run_recipe throw.
Json validate(const ValidationOptions& options);

}  // namespace sidewall::app
