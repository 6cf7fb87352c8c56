#pragma once
#include "app/common/json_fwd.hpp"
#include "app/fit/fit_targets.hpp"
#include "app/fit/least_squares.hpp"
#include "app/sweep/vary.hpp"

namespace sidewall::app {

/// One of a fit's recipes, and its best run.
struct FittedRecipe {
    std::string label;  ///< before its targets' names, with a colon; empty if it is the only one
    const FitTargets& targets;
    const Recipe& best_recipe;
    const SetRun& best_run;
    std::size_t best_number = 0;
    std::filesystem::path best_folder, first_folder;  ///< the first run's: where the fit began
};

/// The end of a fit: parameters, and the best runs.
struct FitEnd {
    const std::vector<Vary>& varied;
    const LeastSquaresResult& found;
    bool several_minima = false;  ///< showed on the way
    std::vector<FittedRecipe> recipes;
};

/// The results that fit.json holds.
Json fit_json(const FitEnd& end);

/// The results in fit.json, as a text table.
std::string fit_table(const Json& fit);

/// A sentence saying by how much targets are missed within the bounds; empty if they are met or the runs did not suffice.
std::string unmet_targets(const Json& fit);

/// The measured profile \p profile and the contours of the best and the first run as comma separated values: the name of a
/// line and a point on it; a point that is empty breaks the line.
std::string overlay_csv(const FittedRecipe& fitted, std::size_t profile);

}  // namespace sidewall::app
