#pragma once
#include "app/fit/least_squares.hpp"

namespace sidewall::app {

/// Longest difference between points that slopes are found from, in the unit box.
constexpr double kMostDifference = 0.2;

/// Variance of a residual from a sum of squares: 1 if standard deviations are known, else the sum over its degrees of freedom;
/// at least the variance of the model's noise.
double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise);

/// Adds covariance, 95 % intervals (Student's) and free directions of the linear model around the optimum. A direction without
/// evaluated points, as where the runs are used up early, has no interval and is not called free.
/// \param slopes  of the residuals at the best point, a column a parameter.
/// \param tested  orthonormal columns: directions along which points were evaluated.
/// \param result  has its best point, residuals, noise and whether it converged.
void add_intervals(const LeastSquares& problem, const Eigen::MatrixXd& slopes, const Eigen::MatrixXd& tested,
                   LeastSquaresResult& result);

/// 97.5 % quantile of Student's distribution. \pre degrees >= 1.
double student_quantile(std::size_t degrees);

}  // namespace sidewall::app
