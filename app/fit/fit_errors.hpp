#pragma once
#include "app/fit/least_squares.hpp"

namespace sidewall::app {

constexpr double kMostDifference = 0.2;  ///< between points that tell slopes

/// Variance of a residual of this sum of squares: of the errors as known, or estimated; of the model's noise, at least.
double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise);

/// Intervals, free directions and their like of a fit that has ended, from the linear model.
/// \param slopes  of the residuals at the best point, a column a parameter.
/// \param tested  orthonormal columns: directions along which points were evaluated.
/// \param result  has its best point, residuals, noise and whether it converged.
void add_errors(const LeastSquares& problem, const Eigen::MatrixXd& slopes, const Eigen::MatrixXd& tested,
                LeastSquaresResult& result);

}  // namespace sidewall::app
