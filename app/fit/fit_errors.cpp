#include "app/fit/fit_errors.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kUnbounded = 1e3;  // a standard deviation

// The direction without components that chance may have given it.
VectorXd significant(const VectorXd& direction) {
    constexpr double kPart = 0.1;
    return (direction.array().abs() < kPart).select(0.0, direction);
}

// A variance, and of how many degrees of freedom it was estimated.
struct Estimate {
    double variance = 0.0, degrees = kInfinity;
};

// Half of the 95 % interval of a sum of two errors.
double half_interval(const Estimate& a, const Estimate& b) {
    const double sum = a.variance + b.variance;
    if (sum <= 0.0) return 0.0;
    const double inverse =
        std::pow(a.variance / sum, 2) / a.degrees + std::pow(b.variance / sum, 2) / b.degrees;
    return student_quantile(1.0 / inverse) * std::sqrt(sum);
}

// The simulation's noise in the residuals of a run.
struct SimulationNoise {
    MatrixXd along;     // its components that parameters can take up: the product with the transpose is their
                        // covariance
    double rest = 0.0;  // variance of all others together
    double degrees = kInfinity;
};

// Deviations of the runs with other seeds from their mean: the product with the transpose is the residuals'
// covariance. No columns without two such runs.
MatrixXd spread_over_seeds(const LeastSquaresResult& result) {
    const Eigen::Index runs = result.repeats.cols();
    if (runs < 2) return MatrixXd(result.residuals.size(), 0);
    const VectorXd mean = result.repeats.rowwise().mean();
    return (result.repeats.colwise() - mean) / std::sqrt(static_cast<double>(runs - 1));
}

// \param basis  orthonormal columns: what the parameters can change of the residuals.
SimulationNoise simulation_noise(const LeastSquaresResult& result, const MatrixXd& basis) {
    const MatrixXd spread = spread_over_seeds(result);
    SimulationNoise noise;
    if (spread.cols() > 0) noise.degrees = static_cast<double>(spread.cols() - 1);
    noise.along = basis.transpose() * spread;
    noise.rest = std::max(0.0, spread.squaredNorm() - noise.along.squaredNorm());
    if (result.grid_steps.size() == 0 || result.grid_steps.isZero(0.0)) return noise;
    // A figure on a step may be off by as much as the step either way.
    noise.along.conservativeResize(Eigen::NoChange, noise.along.cols() + result.grid_steps.size());
    noise.along.rightCols(result.grid_steps.size()) =
        basis.transpose() * (result.grid_steps / std::sqrt(3.0)).asDiagonal();
    return noise;
}

}  // namespace

double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise) {
    if (problem.known_errors) return 1.0 + noise * noise;
    return std::max(noise * noise, degrees > 0.0 ? sum / degrees : 0.0);
}

void add_intervals(const LeastSquares& problem, LeastSquaresResult& result) {
    constexpr double kVanishing = 0.005;  // of the strongest slope
    const MatrixXd &slopes = result.slopes, &tested = result.tested;
    const Eigen::Index count = result.residuals.size(), parameters = slopes.cols();
    const Eigen::JacobiSVD<MatrixXd> svd(tested.cols() > 0 ? MatrixXd(slopes * tested) : slopes,
                                         Eigen::ComputeThinU | Eigen::ComputeFullV);
    const VectorXd& strengths = svd.singularValues();
    result.correlation = find_correlation(result.residuals, slopes, problem.profiles);
    const CorrelatedErrors shared = correlated_errors(result.correlation, svd.matrixU(), problem.profiles);
    const SimulationNoise noise = simulation_noise(result, svd.matrixU());
    const bool estimated = !problem.known_errors && count > parameters, repeated = result.repeats.cols() > 1;
    // Correlated errors that the parameters absorb do not show in the residuals.
    const double left = estimated ? static_cast<double>(count) - shared.widening.trace() : 0.0;
    const double sum = std::max(0.0, result.residuals.squaredNorm() - noise.rest);
    // A model without random numbers may be rough over the parameters all the same.
    const double rough = noise.along.isZero(0.0) ? result.noise : 0.0;
    const double variance = residual_variance(problem, sum, left, rough);
    const double degrees = std::max(1.0, std::round(shared.count) - static_cast<double>(parameters));
    const auto half = [&](double of_targets, double of_noise) {
        return half_interval({variance * of_targets, estimated ? degrees : kInfinity},
                             {of_noise, noise.degrees});
    };
    result.error_from_noise = !problem.known_errors && count <= parameters;
    const double hidden =
        3.0 * result.noise * std::sqrt(2.0 * static_cast<double>(count)) / (2.0 * kMostDifference);
    // Residuals of a search that was cut short are no measure of errors.
    const bool reliable = result.converged || !problem.descends || problem.known_errors;
    MatrixXd unbounded = MatrixXd::Identity(parameters, parameters) - tested * tested.transpose();
    MatrixXd inverse = MatrixXd::Zero(parameters, strengths.size());  // of the slopes that do not vanish
    result.free_directions.clear();
    for (Eigen::Index k = 0; k < tested.cols(); ++k) {
        const VectorXd direction = tested * svd.matrixV().col(k);
        const double slope = k < strengths.size() ? strengths[k] : 0.0;
        const bool vanishes = slope <= std::max(hidden, kVanishing * strengths[0]);
        // An interval as wide as the bounds says nothing that they did not.
        if (vanishes ||
            (reliable && half(shared.widening(k, k), noise.along.row(k).squaredNorm()) > 0.5 * slope))
            result.free_directions.push_back(direction);
        if (vanishes)
            unbounded += significant(direction) * significant(direction).transpose();
        else
            inverse.col(k) = direction / slope;
    }
    MatrixXd of_noise = inverse * noise.along * noise.along.transpose() * inverse.transpose();
    // Without degrees of freedom and noise nothing bounds the error.
    if (result.error_from_noise && variance == 0.0 && of_noise.isZero(0.0))
        unbounded.setIdentity();
    else if (repeated)
        of_noise.diagonal().array() += kSearchTolerance * kSearchTolerance / 3.0;
    const MatrixXd of_targets = inverse * shared.widening * inverse.transpose();
    unbounded *= kUnbounded * kUnbounded;
    result.covariance = variance * of_targets + of_noise + unbounded;
    result.half_interval.resize(parameters);
    for (Eigen::Index k = 0; k < parameters; ++k)
        result.half_interval[k] =
            half(of_targets(k, k), of_noise(k, k)) + std::sqrt(std::max(0.0, unbounded(k, k)));  // rounding
}

VectorXd noise_over_seeds(const LeastSquaresResult& result) {
    const MatrixXd spread = spread_over_seeds(result);
    return spread.cols() > 0 ? VectorXd(spread.rowwise().norm()) : VectorXd();
}

double student_quantile(double degrees) {
    // Without long double, which Boost would compute with at the program's start and which valgrind has no
    // more digits for.
    using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
    constexpr double kUpper = 0.975;
    return quantile(boost::math::students_t_distribution<double, Policy>(degrees), kUpper);
}

}  // namespace sidewall::app
