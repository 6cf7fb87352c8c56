#pragma once
#include "app/common/json_fwd.hpp"
#include "app/fit/fit_targets.hpp"
#include "app/fit/least_squares.hpp"
#include "app/schema/keys.hpp"
#include "app/sweep/vary.hpp"

namespace sidewall::app {

/// One of a fit's recipes, and its best run.
struct FittedRecipe {
    std::string label;  ///< stands before its targets' names; empty if it is the only one
    const FitTargets& targets;
    const Recipe& best_recipe;
    const SetRun& best_run;
    std::size_t best_number = 0;
    std::filesystem::path best_folder, first_folder;  ///< of the best run, and of the first one of the search
};

/// The end of a fit: parameters, and the best runs.
struct FitEnd {
    const std::vector<Vary>& varied;
    const LeastSquaresResult& found;
    bool several_minima = false;  ///< the search met more than one
    std::vector<FittedRecipe> recipes;
};

/// The unit of a varied key, in the recipe's units; "" if none. \p name may begin with a recipe's label.
/// \param keys  settable_keys() of the recipe.
std::string unit_of_key(const std::vector<KeyDoc>& keys, const Recipe& recipe, const std::string& name);

/// The results that fit.json holds.
Json fit_json(const FitEnd& end);

/// The results in fit.json, as a text table.
std::string fit_table(const Json& fit);

/// Remarks on the results in fit.json, sentences without a full stop: missed targets, several minima, keys
/// that the targets do not determine, and targets that change in steps of the grid.
std::vector<std::string> fit_remarks(const Json& fit);

/// A sentence without a full stop: from how many repeats the intervals include the simulation's noise.
std::string noise_remark(const Json& fit);

/// CSV of measured profile number \p profile and the contours of the best and the first run. A row holds the
/// name of a line and a point on it; an empty point breaks the line.
std::string overlay_csv(const FittedRecipe& fitted, std::size_t profile);

}  // namespace sidewall::app
