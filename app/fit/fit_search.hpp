#pragma once
#include <string>

#include "app/fit/least_squares.hpp"

namespace sidewall::app {

/// Root mean square of the residuals: in standard deviations if these are known, else relative to targets.
double misfit(const LeastSquaresResult& found);

/// Whether the misfit is at most two standard deviations or, without these, 1 % or three times the noise.
bool meets_targets(const LeastSquaresResult& found, bool known_errors);

/// The result of a search, and whether it met several minima, of which it is the lowest.
struct FitSearch {
    LeastSquaresResult found;
    bool several_minima = false;
};

/// Runs of a fit that only measure the simulation's noise.
constexpr std::size_t kRepeats = 6;

/// Searches the box by a method of `sidewall fit --method`:
/// - `gauss-newton`: fit_least_squares, quadratic models of every residual.
/// - `bobyqa`: quadratic models of the sum of squares alone (M. J. D. Powell, Cambridge NA2009/06; NLopt's),
///   from the best of the first points: for residuals with kinks, whose slopes mislead.
/// - `crs`: controlled random search with local mutation (P. Kaelo and M. M. Ali, J. Optim. Theory Appl. 130
///   (2006) 253; NLopt's) with half of the runs left, for n keys at least 20 (n + 1) if they suffice, then
///   Gauss-Newton from the best: for several minima.
/// - `auto`: Gauss-Newton. If its end does not meet the targets, again from the one of the first points that
///   is farthest away. If both ends are different minima that miss the targets, as `crs` with the runs left.
/// At the end up to kRepeats runs, at most a quarter of all, repeat the point found with other random
/// numbers. Their spread shows the noise, which the search does not, as its points share random numbers.
/// Errors are those of the linear model there. NLopt's searches ask for one point at a time. Deterministic.
/// \throws as fit_least_squares.
FitSearch search_least_squares(const LeastSquares& problem, const std::string& method);

}  // namespace sidewall::app
