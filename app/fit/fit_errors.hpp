#pragma once
#include "app/fit/least_squares.hpp"

namespace sidewall::app {

/// Longest difference between points that slopes are found from, in the unit box.
constexpr double kMostDifference = 0.2;

/// Shortest step of a search that is worth a run, in the unit box.
constexpr double kSearchTolerance = 0.001;

/// Variance of a residual from a sum of squares: 1 if standard deviations are known, else the sum over its degrees of freedom;
/// at least the variance of the model's noise.
double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise);

/// Adds covariance, 95 % intervals and free directions of the linear model around the optimum. Two errors add up: that of the
/// targets, whose variance is known or estimated from the residuals less what the simulation's noise has in them, and the
/// noise itself, the spread of the repeats seen through the slopes. Student's quantile is that of the sum's degrees of freedom
/// (F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110). A direction without evaluated points, as where the runs are used up
/// early, has no interval and is not called free.
/// \param result  has all but these three: best point, residuals, slopes, repeats, noise and whether it converged.
void add_intervals(const LeastSquares& problem, LeastSquaresResult& result);

/// Standard deviations of the residuals over runs with other random numbers; none without two such runs.
Eigen::VectorXd noise_over_seeds(const LeastSquaresResult& result);

/// 97.5 % quantile of Student's distribution; of an infinite number of degrees the normal one. \pre degrees >= 1.
double student_quantile(double degrees);

}  // namespace sidewall::app
