#pragma once
#include <Eigen/Core>
#include <vector>

namespace sidewall::app {

/// Residuals that are distances of a measured profile's points, in any order.
struct ProfileResiduals {
    Eigen::Index first = 0;               ///< among all residuals
    std::vector<Eigen::Vector2d> points;  ///< where they were measured, one a residual
};

/// Correlation of the errors of two points of a profile: 1 at no distance, else shared * exp(-distance / length).
struct ErrorCorrelation {
    double length = 0.0;  ///< in the points' unit
    double shared = 0.0;  ///< part of the variance that is correlated; the rest is each point's own
};

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
