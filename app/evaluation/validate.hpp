#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

/// Selection of the cases to run, and where the results go.
struct ValidationOptions {
    std::filesystem::path folder{};  ///< of the cases
    std::filesystem::path output;
    std::vector<std::string> cases{};  ///< names; empty: all
    std::filesystem::path history{};   ///< CSV of all versions' figures, in which the rows of these cases and
                                       ///< this version are replaced; empty: none
    bool overwrite = false;            ///< as in RunOptions
    bool resume = false;               ///< existing runs of the same recipes and version are not made again
    std::string resume_command{};      ///< as in RunOptions
    std::function<void(const Json&)> finished{};  ///< called with each case as it ends
};

/// Runs cases (validate_cases.hpp). For all settings of its rows a case is run on its grid, with another seed
/// if it traces, and on twice the spacing. The bar of a figure is the sum of both differences, which for a
/// scheme of first order estimates grid error and noise; a length's grid error is at least 0.1 grid spacings.
///
/// Writes DIR/{validation.json, validation.md}, charts to DIR/validation/NAME.svg and runs to DIR/NAME,
/// NAME-seed and NAME-coarse, for further settings NAME-2 and so on. Cases that are not run keep their rows
/// of the report that exists, if their files have not changed.
/// \returns what validation.json holds.
/// \throws RecipeError for an unknown case; FileError for a damaged validation.json; what validation_cases,
///         case_recipe and run_recipe throw.
Json validate(const ValidationOptions& options);

}  // namespace sidewall::app
