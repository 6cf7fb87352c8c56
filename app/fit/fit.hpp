#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

/// Arguments of a fit, as the user wrote them.
struct FitOptions {
    std::vector<std::string>
        recipes;  ///< files; if several, the LABEL of each is its name without folder and .toml
    std::vector<std::string> overrides;  ///< [LABEL:]key=value, of all recipes' runs or of one's
    std::vector<std::string> vary;       ///< [LABEL:]KEY=LO:HI[:log], shared by all recipes or of one
    std::vector<std::string> targets;    ///< [LABEL:]NAME=VALUE[+-SIGMA], of figures of a summary's metrology
    std::vector<std::string> profiles;   ///< [LABEL:]FILE.csv[\@TIME]
    std::optional<double> profile_sigma;  ///< standard deviation of a profile's points, length
    std::string profile_offset = "none";  ///< or "x", "z", "xz"
    std::string method = "auto";          ///< of the search: fit/fit_search.hpp
    std::size_t max_runs = 60;
    std::size_t jobs = 0;  ///< as in RunSet
    bool resume = false, quiet = false;
    std::filesystem::path output;
    std::string resume_command;
};

/// Finds the values of a recipe's keys, within bounds, at which its runs come closest to the targets
/// (fit/fit_search.hpp). The search begins at the recipe's values and at points spread between the bounds;
/// all its runs have the same random numbers. Several recipes, such as one process in several geometries, are
/// run at every point and fitted together. Writes DIR/fit.json, fit.csv (a row a run), best.toml, overlay.csv
/// for profiles, and runs/NNNN; of several recipes best_LABEL.toml and overlay_LABEL.csv.
/// \returns what fit.json holds.
/// \throws RecipeError, before the first run, for what cannot be fitted; FileError for profiles; Interrupted;
///         IoError; NumericsError if no run has all targets.
Json run_fit(const FitOptions& options);

}  // namespace sidewall::app
