#pragma once
#include "app/common/json_fwd.hpp"
#include "app/fit/fit_targets.hpp"
#include "app/fit/least_squares.hpp"
#include "app/schema/keys.hpp"
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

/// The unit of a varied key, with or without a recipe's label before it, in the recipe's own units; "" without a dimension.
/// \param keys  settable_keys() of the recipe.
std::string unit_of_key(const std::vector<KeyDoc>& keys, const Recipe& recipe, const std::string& name);

/// The results that fit.json holds.
Json fit_json(const FitEnd& end);

/// The results in fit.json, as a text table.
std::string fit_table(const Json& fit);

/// What there is to say about the results in fit.json, in sentences without a full stop: missed targets, other minima, keys and
/// targets that tell nothing.
std::vector<std::string> fit_remarks(const Json& fit);

/// A sentence without a full stop: from how many runs the intervals know the simulation's noise.
std::string noise_remark(const Json& fit);

/// The measured profile \p profile and the contours of the best and the first run as comma separated values: the name of a
/// line and a point on it; a point that is empty breaks the line.
std::string overlay_csv(const FittedRecipe& fitted, std::size_t profile);

}  // namespace sidewall::app
