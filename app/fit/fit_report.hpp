#pragma once
#include "app/common/json_fwd.hpp"
#include "app/fit/fit_targets.hpp"
#include "app/fit/least_squares.hpp"
#include "app/sweep/vary.hpp"

namespace sidewall::app {

/// One of a fit's recipes, and its run that came closest.
struct FittedRecipe {
    std::string label;  ///< before its targets' names, with a colon; empty if it is the only one
    const FitTargets& targets;
    const Recipe& best_recipe;
    const SetRun& best_run;
    std::size_t best_number = 0;
    std::filesystem::path best_folder, first_folder;  ///< the first run's: where the fit began
};

/// A fit's end: its parameters, and the runs there.
struct FitEnd {
    const std::vector<Vary>& varied;
    const LeastSquaresResult& found;
    bool several_minima = false;  ///< showed on the way
    std::vector<FittedRecipe> recipes;
};

/// What fit.json says of it.
Json fit_json(const FitEnd& end);

/// That the targets are not met within the bounds, and by how much, in a sentence; empty if they are, or if the runs did not
/// suffice to tell.
std::string unmet_targets(const Json& fit);

/// The measured profile \p profile and the contours of the best and the first run as comma separated values: the name of a
/// line and a point on it; a point that is empty breaks the line.
std::string overlay_csv(const FittedRecipe& fitted, std::size_t profile);

}  // namespace sidewall::app
