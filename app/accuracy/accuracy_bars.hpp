#pragma once
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "app/recipe/recipe.hpp"
#include "app/results/result.hpp"

// Error bars of figures, from runs that were made to find them.
namespace sidewall::app {

/// The accuracy that a user asks of one figure.
struct AskedAccuracy {
    std::string measure;    ///< of a summary's metrology
    double bound = 0.0;     ///< in the figure's unit, or relative to its value
    bool relative = false;  ///< bound is relative
    std::string text;       ///< as written
};

/// Settings of a run that its accuracy depends on.
struct AccuracySettings {
    double spacing = 0.0;
    double rays = 0.0;                     ///< source rays a species and time step
    std::optional<double> relative_error;  ///< replaces the rays
    std::string method;                    ///< of simplification
    std::int64_t seed = 0;
};

/// One of the runs made to find error bars.
struct AccuracyRun : AccuracySettings {
    std::string folder;  ///< in DIR; empty: DIR itself
    Json summary;

    double seconds() const { return summary["timing"]["total"].get<double>(); }
    /// The figure in its metrology; NaN if it has none.
    double figure(const std::string& measure) const { return figure_of(summary, measure); }
};

/// Noise and simplification error of figures on one grid, found by further runs there.
struct AccuracyNoise {
    AccuracyRun on;                       ///< the run on that grid
    std::map<std::string, double> noise;  ///< 95 % bar of one such run
    std::map<std::string, double> simplification;
};

/// \param others  runs that differ from \p on in seed or simplification alone.
AccuracyNoise noise_of(const AccuracyRun& on, const std::vector<AccuracyRun>& others);

/// Noise of a run with settings \p to over that with \p from. It falls with the square root of the rays. At
/// equal rays a finer grid has fewer rays a cell, which more time steps average only in part: noise grows as
/// spacing^-1/2, or not at all if \p flat, for a profile in x and z. With a relative error noise is
/// proportional to that error and to spacing^1/2.
double noise_factor(const AccuracySettings& from, const AccuracySettings& to, bool flat);

/// A figure's value and error bars, in its unit.
struct AccuracyBars {
    double value = 0.0, grid = 0.0, noise = 0.0, simplification = 0.0;
    std::string reason;  ///< why the bars are not known, or `grid` is large
    bool known = false;  ///< the bars can be relied on
    double asked = 0.0;  ///< 0: not asked for
    double total() const {
        return std::hypot(std::hypot(grid, noise), simplification);
    }  ///< root sum of squares: the errors are independent
    bool reached() const { return known && total() <= asked; }
};

/// \param grids  runs of the same recipe, coarsest first; the bars are those of the last run.
/// \param asked  or nullptr.
AccuracyBars bars_of(const std::string& measure, const Recipe& recipe, const std::vector<AccuracyRun>& grids,
                     const std::optional<AccuracyNoise>& noise, const AskedAccuracy* asked);

/// Entries of summary.json's `accuracy` and `accuracy_runs`.
Json bars_json(const AccuracyBars& bars, const AskedAccuracy* asked);
Json run_json(const AccuracyRun& run);

/// The bars in a summary, as a text table.
std::string accuracy_table(const Json& summary);

/// Reads `MEASURE=BOUND` or `MEASURE=PERCENT%` and makes \p recipe measure these figures.
/// \throws RecipeError, with the nearest name, for what no run measures, or for a bound that is not above 0.
std::vector<AskedAccuracy> read_accuracy(const std::vector<std::string>& texts, Recipe& recipe);

/// A figure on one grid.
struct GridValue {
    double spacing = 0.0;
    double value = 0.0;  ///< not finite where the grid does not have it
    double noise = 0.0;  ///< 95 % bar due to random numbers
};

/// Bound of the difference of a figure on the finest grid from that on an infinitely fine one.
struct GridError {
    double bar = 0.0;    ///< infinite if it is unknown
    std::string reason;  ///< why it is unknown or large; empty if differences between grids fall as they
                         ///< should
    bool falling() const { return reason.empty(); }
};

/// Roache's grid convergence index (P. J. Roache, J. Fluids Eng. 116 (1994) 405), of order 1 at most. From
/// the last three grids the error on the finest is |f2 - f1| / (r^p - 1), times a safety factor of 1.25, with
/// r the ratio of spacings and p the order seen, at most 1. It is no less than what the next coarser pair
/// leaves at order 2, as two values may agree by chance. Values that go up and down enclose the limit: the
/// error is their last difference, or the one before over r if that is larger. The factor is 3 for two grids,
/// or if differences do not fall.
///
/// \param grids  coarsest first, spacings falling; grids before one that lacks the figure do not count.
/// \param least  smallest bar that is returned.
GridError grid_error(const std::vector<GridValue>& grids, double least);

}  // namespace sidewall::app
