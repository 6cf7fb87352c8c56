#pragma once
#include <string>
#include <vector>

#include "app/accuracy/accuracy_bars.hpp"
#include "app/process/simulation.hpp"

namespace sidewall::app {

/// Whether a step of the recipe traces particles, so that another seed gives other figures.
bool traces(const Recipe& recipe);

/// Runs a recipe on finer and finer grids, from four times its spacing to a quarter of it, until the bars of the figures asked
/// for are small enough. On the coarsest grid further seeds measure the noise, from which the rays of the finer ones follow, and
/// runs without simplification measure its effect; where that is too large, finer grids do without.
///
/// The bar of a figure is the root sum of squares of three: grid (grid_error), noise (95 %,
/// Student's, of five runs, scaled by rays and spacing) and simplification (scaled by the spacing, unless the recipe gives
/// lengths of its own for it). A figure is unknown where too few grids have it, differences between grids do not
/// fall, or events differ between the two finest.
///
/// The run settled on is DIR's; those before it leave recipe and summary in DIR/accuracy/grid_K, the others are whole in
/// DIR/accuracy. With \p options resume those that are there are not made again. summary.json gets `accuracy` (by
/// measure), `accuracy_runs` and `accuracy_seconds`.
///
/// \param overrides  with which the recipe was read from its file, whose lines messages name.
/// \throws RecipeError for a recipe that starts from another run, whose grid is given; what run_recipe throws.
RunResult run_to_accuracy(const Recipe& recipe, const std::vector<std::string>& overrides,
                          const std::vector<AskedAccuracy>& asked, const RunOptions& options);

}  // namespace sidewall::app
