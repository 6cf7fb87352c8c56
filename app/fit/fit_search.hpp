#pragma once
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

/// Searches the box by fit_least_squares; where that ends without meeting the targets, again from the first point farthest
/// from there.
///
/// At the end up to kRepeats runs at the point found, at most a quarter of all, have random numbers of their own: their spread is the
/// noise that the searched points, which share theirs, do not show. Errors are those of the linear model there. Deterministic.
/// \throws as fit_least_squares.
FitSearch search_least_squares(const LeastSquares& problem);

}  // namespace sidewall::app
