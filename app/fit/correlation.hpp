#pragma once
#include <Eigen/Core>
#include <vector>

namespace sidewall::app {

/// Residuals that are distances of a measured profile's points, in any order.
struct ProfileResiduals {
    Eigen::Index first = 0;               ///< among all residuals
    std::vector<Eigen::Vector2d> points;  ///< where they were measured, one a residual
};

/// How alike the errors of two points of a profile are: 1 at no distance, else shared * exp(-distance / length).
struct ErrorCorrelation {
    double length = 0.0;  ///< in the points' unit
    double shared = 0.0;  ///< part of the variance that neighbours share; the rest each point has for itself
};

/// The likeliest correlation, by restricted likelihood (H. D. Patterson and R. Thompson, Biometrika 58 (1971) 545), which leaves
/// aside what a fit of linear parameters takes out of the errors: the residuals alone look less correlated than these. Of many
/// points, balls of neighbours are looked at, since the ones between them tell how soon errors differ.
/// \param slopes  of the residuals, a column a parameter.
/// \returns none (shared 0) if there are too few points to tell. O(points looked at ^3), of which there are at most 240.
ErrorCorrelation find_correlation(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& slopes,
                                  const std::vector<ProfileResiduals>& profiles);

/// What a correlation does to the errors of a fit whose weights do not know of it.
struct CorrelatedErrors {
    Eigen::MatrixXd widening;  ///< B^T C B: 1 where errors are independent
    double count = 0.0;        ///< of independent residuals that tell a variance as well
};

/// \param basis  orthonormal columns, as long as the residuals. O(points of a profile ^2).
CorrelatedErrors correlated_errors(const ErrorCorrelation& correlation, const Eigen::MatrixXd& basis,
                                   const std::vector<ProfileResiduals>& profiles);

}  // namespace sidewall::app
