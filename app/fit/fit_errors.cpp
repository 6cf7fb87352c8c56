#include "app/fit/fit_errors.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace sidewall::app {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kUnbounded = 1e3;  // a standard deviation

// The direction without components that chance may have given it.
VectorXd significant(const VectorXd& direction) {
    constexpr double kPart = 0.1;
    return (direction.array().abs() < kPart).select(0.0, direction);
}

}  // namespace

double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise) {
    if (problem.known_errors) return 1.0 + noise * noise;
    return std::max(noise * noise, degrees > 0.0 ? sum / degrees : 0.0);
}

void add_intervals(const LeastSquares& problem, const MatrixXd& slopes, const MatrixXd& tested,
                   LeastSquaresResult& result) {
    constexpr double kVanishing = 0.005;  // of the strongest slope
    constexpr double kNormal = 1.959964;
    const Eigen::Index count = result.residuals.size(), parameters = slopes.cols();
    const Eigen::JacobiSVD<MatrixXd> svd(tested.cols() > 0 ? MatrixXd(slopes * tested) : slopes,
                                         Eigen::ComputeThinU | Eigen::ComputeFullV);
    const VectorXd& strengths = svd.singularValues();
    result.correlation = find_correlation(result.residuals, slopes, problem.profiles);
    const CorrelatedErrors shared = correlated_errors(result.correlation, svd.matrixU(), problem.profiles);
    const bool estimated = !problem.known_errors && count > parameters;
    // Correlated errors that the parameters absorb do not show in the residuals.
    const double left = estimated ? static_cast<double>(count) - shared.widening.trace() : 0.0;
    const double sigma =
        std::sqrt(residual_variance(problem, result.residuals.squaredNorm(), left, result.noise));
    const double degrees = std::max(1.0, std::round(shared.count) - static_cast<double>(parameters));
    const double quantile = estimated ? student_quantile(static_cast<std::size_t>(degrees)) : kNormal;
    result.error_from_noise = !problem.known_errors && count <= parameters;
    const double hidden =
        3.0 * result.noise * std::sqrt(2.0 * static_cast<double>(count)) / (2.0 * kMostDifference);
    // Residuals of a search that was cut short are no measure of errors.
    const bool reliable = result.converged || !problem.descends || problem.known_errors;
    MatrixXd unbounded = MatrixXd::Identity(parameters, parameters) - tested * tested.transpose();
    MatrixXd inverse = MatrixXd::Zero(parameters, strengths.size());  // of the slopes that do not vanish
    for (Eigen::Index k = 0; k < tested.cols(); ++k) {
        const VectorXd direction = tested * svd.matrixV().col(k);
        const double slope = k < strengths.size() ? strengths[k] : 0.0;
        const bool vanishes = slope <= std::max(hidden, kVanishing * strengths[0]);
        // An interval as wide as the bounds says nothing that they did not.
        if (vanishes || (reliable && quantile * sigma * std::sqrt(shared.widening(k, k)) > 0.5 * slope))
            result.free_directions.push_back(direction);
        if (vanishes)
            unbounded += significant(direction) * significant(direction).transpose();
        else
            inverse.col(k) = direction / slope;
    }
    result.covariance =
        sigma * sigma * inverse * shared.widening * inverse.transpose() + kUnbounded * kUnbounded * unbounded;
    result.half_interval = quantile * result.covariance.diagonal().cwiseSqrt();
    // Without degrees of freedom and noise nothing bounds the error.
    if (result.error_from_noise && result.noise == 0.0) result.half_interval.setConstant(kUnbounded);
}

double student_quantile(std::size_t degrees) {
    // Without long double, which Boost would compute with at the program's start and which valgrind has no
    // more digits for.
    using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
    constexpr double kUpper = 0.975;
    return quantile(boost::math::students_t_distribution<double, Policy>(static_cast<double>(degrees)),
                    kUpper);
}

}  // namespace sidewall::app
