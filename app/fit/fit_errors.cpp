#include "app/fit/fit_errors.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/fit/student.hpp"

namespace sidewall::app {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kUnbounded = 1e3;  // a standard deviation

// A direction less what it has by chance of others.
VectorXd significant(const VectorXd& direction) {
    constexpr double kPart = 0.1;
    return (direction.array().abs() < kPart).select(0.0, direction);
}

}  // namespace

double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise) {
    if (problem.known_errors) return 1.0 + noise * noise;
    return std::max(noise * noise, degrees > 0.0 ? sum / degrees : 0.0);
}

void add_errors(const LeastSquares& problem, const MatrixXd& slopes, const MatrixXd& tested,
                LeastSquaresResult& result) {
    constexpr double kVanishing = 0.005;  // of the strongest slope
    constexpr double kNormal = 1.959964;
    const Eigen::Index count = result.residuals.size(), parameters = slopes.cols();
    const Eigen::JacobiSVD<MatrixXd> svd(tested.cols() > 0 ? MatrixXd(slopes * tested) : slopes,
                                         Eigen::ComputeThinU | Eigen::ComputeFullV);
    result.correlation = find_correlation(result.residuals, slopes, problem.profiles);
    const CorrelatedErrors shared = correlated_errors(result.correlation, svd.matrixU(), problem.profiles);
    const bool estimated = !problem.known_errors && count > parameters;
    // What the parameters take up of errors that neighbours share does not show in the residuals.
    const double left = estimated ? static_cast<double>(count) - shared.widening.trace() : 0.0;
    const double sigma =
        std::sqrt(residual_variance(problem, result.residuals.squaredNorm(), left, result.noise));
    const double degrees = std::max(1.0, std::round(shared.count) - static_cast<double>(parameters));
    const double quantile = estimated ? student_quantile(static_cast<std::size_t>(degrees)) : kNormal;
    result.error_from_noise = !problem.known_errors && count <= parameters;
    const double hidden =
        3.0 * result.noise * std::sqrt(2.0 * static_cast<double>(count)) / (2.0 * kMostDifference);
    // Residuals of a search that has not come to its end tell no errors.
    const bool told = result.converged || !problem.descends || problem.known_errors;
    MatrixXd errors(parameters, tested.cols());  // along the singular directions
    MatrixXd together = MatrixXd::Identity(tested.cols(), tested.cols());
    for (Eigen::Index k = 0; k < tested.cols(); ++k) {
        const VectorXd direction = tested * svd.matrixV().col(k);
        const double slope = k < svd.singularValues().size() ? svd.singularValues()[k] : 0.0;
        const double widening = k < shared.widening.cols() ? std::sqrt(shared.widening(k, k)) : 1.0;
        const bool vanishes = slope <= std::max(hidden, kVanishing * svd.singularValues()[0]);
        // An interval as wide as the bounds says nothing that they did not.
        if (vanishes || (told && quantile * sigma * widening > 0.5 * slope))
            result.free_directions.push_back(direction);
        // What a vanishing slope is worth, its noise decides; so is which parameters it belongs to in part.
        errors.col(k) = vanishes ? (kUnbounded * significant(direction)).eval()
                                 : (std::min(kUnbounded, sigma * widening / slope) * direction).eval();
        for (Eigen::Index j = 0; j < k && !vanishes; ++j)
            together(j, k) = together(k, j) =
                shared.widening(j, k) / (widening * std::sqrt(shared.widening(j, j)));
    }
    result.covariance =
        kUnbounded * kUnbounded * (MatrixXd::Identity(parameters, parameters) - tested * tested.transpose()) +
        errors * together * errors.transpose();
    result.half_interval = quantile * result.covariance.diagonal().cwiseSqrt();
    // As many keys as targets, and no noise seen: nothing tells the error.
    if (result.error_from_noise && result.noise == 0.0) result.half_interval.setConstant(kUnbounded);
}

}  // namespace sidewall::app
