#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

namespace sidewall::app {

/// Residuals that are distances of a measured profile's points, in any order.
struct ProfileResiduals {
    Eigen::Index first = 0;               ///< among all residuals
    std::vector<Eigen::Vector2d> points;  ///< where they were measured, one a residual
};

/// Correlation of two errors along a profile: 1 at no distance, else shared * exp(-distance / length).
struct ErrorCorrelation {
    double length = 0.0;  ///< in the points' unit
    double shared = 0.0;  ///< part of the variance that is correlated; the rest is each point's own
};

/// A point of the unit box, a coordinate a parameter, and the residuals there; none where a run failed.
using BoxPoint = Eigen::VectorXd;
using Residuals = std::optional<Eigen::VectorXd>;

/// A point that has been evaluated.
struct FitTrial {
    BoxPoint x;
    Residuals residuals;
    /// Sum of squares; infinite without residuals, or where one is not finite.
    double cost() const;
};

/// A least squares problem in the unit box: the residuals are those of a costly, slightly noisy model.
struct LeastSquares {
    BoxPoint start;
    /// Residuals at several points, which may be computed at the same time. Their number is the same at all
    /// points; each is divided by its standard deviation or scale.
    std::function<std::vector<Residuals>(const std::vector<BoxPoint>&)> evaluate;
    /// Residuals of so many further runs at a point, with other random numbers. Empty if the model has none.
    std::function<std::vector<Residuals>(const BoxPoint&, std::size_t)> repeat;
    std::size_t max_runs = 60;    ///< points that may be evaluated, known ones and repeats included
    bool known_errors = false;    ///< residuals are in standard deviations; else estimate these
    std::vector<FitTrial> known;  ///< evaluated before; the search starts at the best of them
    std::optional<double> noise;  ///< as in the result, if it is known
    bool descends = true;         ///< false: only find the errors of the best known point
    std::vector<ProfileResiduals>
        profiles;  ///< residuals with correlated errors; those of all others are independent
};

/// The result of a fit; parameters in box coordinates.
struct LeastSquaresResult {
    BoxPoint best;
    Eigen::VectorXd residuals;
    Eigen::MatrixXd slopes;         ///< of the residuals at the best point, a column a parameter
    Eigen::MatrixXd tested;         ///< orthonormal columns: directions along which points were evaluated
    Eigen::MatrixXd repeats;        ///< residuals at the best point with other random numbers, a column a run
    Eigen::VectorXd grid_steps;     ///< of residuals that change in steps of the grid; else 0
    Eigen::MatrixXd covariance;     ///< of the parameters
    Eigen::VectorXd half_interval;  ///< of 95 %; in the hundreds where nothing bounds it
    double noise = 0.0;             ///< standard deviation of a residual between nearby points
    double scatter =
        0.0;  ///< standard deviation of a residual about the quadratic model at points that show slopes
    ErrorCorrelation correlation;   ///< of errors along profiles, with which the covariance is found
    bool converged = false;         ///< else the runs were used up
    bool error_from_noise = false;  ///< no degree of freedom was left: errors are only the model's noise
    std::vector<Eigen::VectorXd> free_directions;  ///< unit vectors along which the residuals do not change
    std::size_t runs = 0;
};

/// Surrogate search: quadratic polynomials of all residuals, a ridge regression over the points evaluated so
/// far, are minimised by NLopt's BOBYQA within a trust region and the box (a derivative-free Gauss-Newton
/// method, as C. Cartis and L. Roberts, Math. Prog. Comput. 11 (2019) 631); the minimum is evaluated next. It
/// begins at the best of first_points. Points are added along directions whose slopes the regression leaves
/// uncertain, farther apart where noise would hide a slope. Noise is a second difference of three close
/// points (J. More and S. Wild, SIAM J. Sci. Comput. 33 (2011) 1292). At the end central differences around
/// the optimum give the slopes for add_intervals. Deterministic.
/// \throws what \p evaluate throws; NumericsError if none of the first points has residuals.
LeastSquaresResult fit_least_squares(const LeastSquares& problem);

/// The points where a search begins: the start and Sobol points, at most a quarter of the runs.
std::vector<BoxPoint> first_points(const LeastSquares& problem);

/// The number of first points if the runs suffice.
std::size_t count_first(Eigen::Index parameters);

}  // namespace sidewall::app
