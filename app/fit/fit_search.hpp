#pragma once
#include <string>

#include "app/fit/least_squares.hpp"

namespace sidewall::app {

/// Root mean square of the residuals: of what is asked for, or in standard deviations where these are known.
double misfit(const LeastSquaresResult& found);

/// Whether the misfit is at most 1 %, or three times a run's noise, or two standard deviations.
bool meets_targets(const LeastSquaresResult& found, bool known_errors);

/// The end of a search, and whether it met several minima, of which this is the lowest.
struct FitSearch {
    LeastSquaresResult found;
    bool several_minima = false;
};

/// Runs of a fit that only tell the simulation's noise.
constexpr std::size_t kRepeats = 6;

/// Searches the box by one of the ways that `sidewall fit --method` takes:
/// - `gauss-newton`: fit_least_squares, quadratic models of every residual.
/// - `bobyqa`: quadratic models of the sum of squares alone (M. J. D. Powell, Cambridge NA2009/06; NLopt's), from the best of
///   the first points: for residuals with kinks, whose slopes mislead.
/// - `crs`: controlled random search with local mutation (P. Kaelo and M. M. Ali, J. Optim. Theory Appl. 130 (2006) 253;
///   NLopt's) with at most half of the runs, then Gauss-Newton from the best point: for several minima.
/// - `auto`: Gauss-Newton; where the targets are not met there, again from the first point farthest from where that ended; where
///   the two end at different minima, neither of which meets the targets, on as `crs` with the runs that are left.
///
/// At the end up to kRepeats runs at the point found, at most a quarter of all, have random numbers of their own: their spread is the
/// noise that the searched points, which share theirs, do not show. Errors are those of the linear model there. NLopt's searches ask for one point at a time. Deterministic.
/// \throws as fit_least_squares.
FitSearch search_least_squares(const LeastSquares& problem, const std::string& method);

}  // namespace sidewall::app
