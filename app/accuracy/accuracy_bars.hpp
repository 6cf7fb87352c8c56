#pragma once
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "app/recipe/recipe.hpp"
#include "app/results/result.hpp"

// The bars of figures from the runs that were made for them.
namespace sidewall::app {

/// The accuracy that a user asks of one figure.
struct AskedAccuracy {
    std::string measure;    ///< of a summary's metrology
    double bound = 0.0;     ///< in its unit, or a part of its value
    bool relative = false;  ///< a part
    std::string text;       ///< as written
};

/// Settings that the exactness of a run depends on.
struct AccuracySettings {
    double spacing = 0.0;
    double rays = 0.0;                     ///< source rays a species and time step
    std::optional<double> relative_error;  ///< instead
    std::string method;                    ///< of simplification
    std::int64_t seed = 0;
};

/// One of the runs made for the bars.
struct AccuracyRun : AccuracySettings {
    std::string folder;  ///< in DIR; empty: DIR itself
    Json summary;

    double seconds() const { return summary["timing"]["total"].get<double>(); }
    /// The figure in its metrology; NaN if it has none.
    double figure(const std::string& measure) const { return figure_of(summary, measure); }
};

/// Noise and simplification error of the figures on one grid, from further runs there.
struct AccuracyNoise {
    AccuracyRun on;                       ///< the run they were made beside
    std::map<std::string, double> noise;  ///< 95 % bar of one such run
    std::map<std::string, double> simplification;
};

/// \param others  runs that differ from \p on in seed or simplification alone.
AccuracyNoise noise_of(const AccuracyRun& on, const std::vector<AccuracyRun>& others);

/// Ratio of the noise of one run to another's. It falls with the square root of the rays; at equal rays it grows as a cell's
/// share of them falls, less what the more numerous time steps of a finer grid average out.
/// \param flat  a profile in x and z.
double noise_factor(const AccuracySettings& from, const AccuracySettings& to, bool flat);

/// A figure's bars, in its unit.
struct AccuracyBars {
    double value = 0.0, grid = 0.0, noise = 0.0, simplification = 0.0;
    std::string reason;  ///< why it is not known, or grid is large
    bool known = false;  ///< the bars are to be relied on
    double asked = 0.0;  ///< 0: not asked for
    double total() const {
        return std::hypot(std::hypot(grid, noise), simplification);
    }  ///< of independent errors
    bool reached() const { return known && total() <= asked; }
};

/// \param grids  of the same recipe, coarsest first; the bars are the last one's.
/// \param asked  or nullptr.
AccuracyBars bars_of(const std::string& measure, const Recipe& recipe, const std::vector<AccuracyRun>& grids,
                     const std::optional<AccuracyNoise>& noise, const AskedAccuracy* asked);

/// Entries of summary.json's `accuracy` and `accuracy_runs`.
Json bars_json(const AccuracyBars& bars, const AskedAccuracy* asked);
Json run_json(const AccuracyRun& run);

/// The bars in a summary, as a text table.
std::string accuracy_table(const Json& summary);

/// Reads `MEASURE=BOUND` or `MEASURE=PERCENT%` and makes \p recipe measure them.
/// \throws RecipeError, with the nearest name, for what no run measures or a bound that is not above 0.
std::vector<AskedAccuracy> read_accuracy(const std::vector<std::string>& texts, Recipe& recipe);

/// A figure on one grid.
struct GridValue {
    double spacing = 0.0;
    double value = 0.0;  ///< not finite where the grid does not have it
    double noise = 0.0;  ///< 95 % bar of the random numbers alone
};

/// Bound of the difference between the figure on the finest grid and on an infinitely fine one.
struct GridError {
    double bar = 0.0;    ///< infinite if it is unknown
    std::string reason;  ///< why it is not known, or why it is no better than it is; empty: differences fall
                         ///< as they should
    bool falling() const { return reason.empty(); }
};

/// Roache's grid convergence index (P. J. Roache, J. Fluids Eng. 116 (1994) 405) of order 1 or less: from the last three
/// grids the error on the finest is |f2 - f1| / (r^p - 1) with r the ratio of spacings, p the order seen, at most 1, times a
/// safety factor of 1.25; no less than what the next coarser pair leaves at order 2, so that two values that agree by chance claim
/// nothing; of values that go up and down, whose last two enclose the limit, their difference. The factor is 3 where
/// there are two grids, or differences do not fall.
///
/// \param grids  coarsest first, spacings falling; those before a grid that does not have the figure do not count.
/// \param least  no smaller bar is given where there is any.
GridError grid_error(const std::vector<GridValue>& grids, double least);

}  // namespace sidewall::app
