#pragma once
#include <Eigen/Core>
#include <vector>

#include "app/fit/least_squares.hpp"

namespace sidewall::app {

/// Largest distance, in the unit box, between points whose differences give slopes.
constexpr double kMostDifference = 0.2;

/// Shortest step of a search that is worth a run, in the unit box.
constexpr double kSearchTolerance = 0.001;

/// Variance of a residual: 1 plus that of the model's noise if standard deviations are known, else the larger
/// of the noise's and the sum of squares over its degrees of freedom. \param noise  standard deviation.
double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise);

/// Adds covariance, 95 % intervals and free directions of the linear model around the optimum. Two errors add
/// up: that of the targets, whose variance is known or estimated from the residuals less the simulation's
/// noise in them, and that noise: the spread of the repeats divided by the slopes. Student's quantile is that
/// of the sum's degrees of freedom (F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110). A direction
/// without evaluated points, as where runs are used up early, has no interval and is not called free.
/// \param result  has best, residuals, slopes, tested, repeats, grid_steps, noise, scatter and converged.
void add_intervals(const LeastSquares& problem, LeastSquaresResult& result);

/// Standard deviations of residuals over repeats with other random numbers; empty for fewer than two.
Eigen::VectorXd noise_over_seeds(const LeastSquaresResult& result);

/// 97.5 % quantile of Student's distribution; at infinitely many degrees the normal one. \pre degrees >= 1.
double student_quantile(double degrees);

/// Error correlation of greatest restricted likelihood (H. D. Patterson and R. Thompson, Biometrika 58 (1971)
/// 545), which unlike the plain one allows for errors that the parameters absorb. It is searched on a grid.
/// \param slopes  of the residuals, a column a parameter.
/// \returns shared 0 for too few points. O(n^3) in the points, of which at most 240 are used.
ErrorCorrelation find_correlation(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& slopes,
                                  const std::vector<ProfileResiduals>& profiles);

/// The effect of correlated errors on a fit that weighs residuals as if they were independent.
struct CorrelatedErrors {
    Eigen::MatrixXd widening;  ///< B^T C B with basis B, correlation C; identity if C is
    double count = 0.0;        ///< number of independent residuals that estimate a variance as well
};

/// \param basis  orthonormal columns, as long as the residuals. O(n^2) in the points of a profile.
CorrelatedErrors correlated_errors(const ErrorCorrelation& correlation, const Eigen::MatrixXd& basis,
                                   const std::vector<ProfileResiduals>& profiles);

}  // namespace sidewall::app
