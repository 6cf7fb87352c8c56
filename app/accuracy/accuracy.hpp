#pragma once
#include <string>
#include <vector>

#include "app/accuracy/accuracy_bars.hpp"
#include "app/process/simulation.hpp"

namespace sidewall::app {

/// Whether a step of the recipe traces particles, so that figures depend on the seed.
bool traces(const Recipe& recipe);

/// Runs a recipe on finer and finer grids, from four times its spacing to a quarter of it, until the error
/// bars of the figures asked for are small enough. On the first grid that has all these figures, at the
/// latest that of the recipe, further seeds measure the noise, which sets the rays on finer grids, and runs
/// without simplification its effect; if that is too large, finer grids do without.
///
/// The bar of a figure is the root sum of squares of three: grid (grid_error), noise (95 %, Student's with
/// three degrees of freedom, scaled by rays and spacing) and simplification (scaled by the spacing, unless
/// the recipe sets its lengths). A figure is unknown if too few grids have it, if differences between grids
/// do not fall, or if events differ between the two finest grids.
///
/// The final run is in DIR; coarser grids leave recipe and summary in DIR/accuracy/grid_K, the other runs are
/// whole in DIR/accuracy. With options.resume existing runs are not made again. summary.json gets `accuracy`
/// (by measure), `accuracy_runs` and `accuracy_seconds`.
///
/// \param overrides  with which the recipe was read from its file, whose lines messages name.
/// \throws RecipeError for a recipe that starts from another run and so on its grid; what run_recipe()
///         throws.
RunResult run_to_accuracy(const Recipe& recipe, const std::vector<std::string>& overrides,
                          const std::vector<AskedAccuracy>& asked, const RunOptions& options);

}  // namespace sidewall::app
