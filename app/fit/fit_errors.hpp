#pragma once
#include <Eigen/Core>
#include <vector>

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

/// The most likely correlation by restricted likelihood (H. D. Patterson and R. Thompson, Biometrika 58 (1971) 545): unlike the
/// plain likelihood it allows for what the parameters absorb of the errors. Lengths and shares are tried on a grid.
/// \param slopes  of the residuals, a column a parameter.
/// \returns shared 0 for too few points. O(points^3), of which at most 240 are used.
ErrorCorrelation find_correlation(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& slopes,
                                  const std::vector<ProfileResiduals>& profiles);

/// The effect of correlated errors on a fit that weighs residuals as if they were independent.
struct CorrelatedErrors {
    Eigen::MatrixXd widening;  ///< B^T C B: 1 where errors are independent
    double count = 0.0;        ///< of independent residuals that estimate a variance as well
};

/// \param basis  orthonormal columns, as long as the residuals. O(points of a profile ^2).
CorrelatedErrors correlated_errors(const ErrorCorrelation& correlation, const Eigen::MatrixXd& basis,
                                   const std::vector<ProfileResiduals>& profiles);

}  // namespace sidewall::app
