#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "app/fit/correlation.hpp"

namespace sidewall::app {

/// A point of the unit box, a coordinate a parameter; its residuals; none where they could not be found.
using BoxPoint = Eigen::VectorXd;
using Residuals = std::optional<Eigen::VectorXd>;

/// A point that has been evaluated.
struct FitTrial {
    BoxPoint x;
    Residuals residuals;
};

/// Residuals of a costly, slightly noisy model, of which the sum of squares is to be least within the unit box.
struct LeastSquares {
    BoxPoint start;
    /// Residuals at several points, which may be found at the same time; as many of them at every point, each over
    /// its standard deviation or scale.
    std::function<std::vector<Residuals>(const std::vector<BoxPoint>&)> evaluate;
    std::size_t max_runs = 60;    ///< points that may be evaluated, the known ones among them
    bool known_errors = false;    ///< residuals are in standard deviations; else that is estimated from them
    std::vector<FitTrial> known;  ///< evaluated before: the search goes on from the best of them
    std::optional<double> noise;  ///< as in the result, where it is known
    bool descends = true;         ///< else the best known point is taken, and its errors alone are found
    std::vector<ProfileResiduals>
        profiles;  ///< whose errors neighbours share; all other residuals have their own
};

/// What a fit found; parameters in box coordinates.
struct LeastSquaresResult {
    BoxPoint best;
    Eigen::VectorXd residuals;
    Eigen::MatrixXd covariance;     ///< of the parameters
    Eigen::VectorXd half_interval;  ///< of 95 %; hundreds where nothing bounds it
    double noise = 0.0;             ///< standard deviation of a residual from one nearby point to the next
    ErrorCorrelation correlation;   ///< of errors along profiles, with which the covariance is found
    bool converged = false;         ///< else the runs were used up
    bool error_from_noise =
        false;  ///< no degree of freedom was left, and errors are those of the model's noise
    std::vector<Eigen::VectorXd>
        free_directions;  ///< along which the residuals do not tell points apart, unit vectors
    std::size_t runs = 0;
};

/// Gauss-Newton steps within a trust region and the box, from the best of \p start and some of Sobol's points. Slopes
/// are regressions over the points near the best one (as in derivative-free Gauss-Newton: C. Cartis and L. Roberts,
/// Math. Prog. Comput. 11 (2019) 631), spread where these leave a direction open, and farther apart along directions
/// where the model's noise, which two points close to the best one tell (as J. More and S. Wild, SIAM J. Sci. Comput. 33
/// (2011) 1292), would hide a slope. Intervals are Student's, from the linear model; a direction along which slopes vanish
/// is looked at once more by central differences before it is called free. One along which no points lie, as where the runs
/// are used up early, has no interval and is not called free. Deterministic.
/// \throws what \p evaluate throws; NumericsError if none of the first points has residuals.
LeastSquaresResult fit_least_squares(const LeastSquares& problem);

/// Where a search begins: \p problem's start, and some of Sobol's points.
std::vector<BoxPoint> first_points(const LeastSquares& problem);

}  // namespace sidewall::app
