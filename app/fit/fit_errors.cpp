#include "app/fit/fit_errors.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>

#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector2d, Eigen::VectorXd;

constexpr double kUnbounded = 1e3;  // standard deviation, in the unit box, where nothing bounds it

// The direction without its small components, which may be due to chance.
VectorXd significant(const VectorXd& direction) {
    constexpr double kPart = 0.1;
    return (direction.array().abs() < kPart).select(0.0, direction);
}

struct Estimate {
    double variance = 0.0, degrees = kInfinity;
};

// Half of the 95 % interval of a sum of two errors, by Satterthwaite.
double half_interval(const Estimate& a, const Estimate& b) {
    const double sum = a.variance + b.variance;
    if (sum <= 0.0) return 0.0;
    const double inverse =
        std::pow(a.variance / sum, 2) / a.degrees + std::pow(b.variance / sum, 2) / b.degrees;
    return student_quantile(1.0 / inverse) * std::sqrt(sum);
}

struct SimulationNoise {
    MatrixXd along;     // the components that parameters can absorb: the product with the transpose is
                        // their covariance
    double rest = 0.0;  // variance of all other components together
    double degrees = kInfinity;
};

// Deviations of the repeats with other seeds from their mean, scaled: the product with the transpose is the
// residuals' covariance. No columns without two repeats.
MatrixXd spread_over_seeds(const LeastSquaresResult& result) {
    const Index runs = result.repeats.cols();
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
    // A figure that changes in steps may be off by a step either way: its variance is step^2 / 3.
    noise.along.conservativeResize(Eigen::NoChange, noise.along.cols() + result.grid_steps.size());
    noise.along.rightCols(result.grid_steps.size()) =
        basis.transpose() * (result.grid_steps / std::sqrt(3.0)).asDiagonal();
    return noise;
}

double correlation_at(const ErrorCorrelation& correlation, double distance) {
    return correlation.shared * std::exp(-distance / correlation.length);
}

// Indices of at most \p most points: all, or three balls of neighbours, which have short distances, too.
std::vector<std::size_t> neighbours(const std::vector<Vector2d>& points, std::size_t most) {
    constexpr std::size_t kBalls = 3;
    std::vector<std::size_t> order(points.size()), chosen;
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (points.size() <= most) return order;
    for (std::size_t ball = 0; ball < kBalls; ++ball) {
        const Vector2d& middle = points[(2 * ball + 1) * points.size() / (2 * kBalls)];
        const auto end = order.begin() + static_cast<std::ptrdiff_t>(most / kBalls);
        std::partial_sort(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
            return (points[a] - middle).squaredNorm() < (points[b] - middle).squaredNorm();
        });
        chosen.insert(chosen.end(), order.begin(), end);
    }
    std::sort(chosen.begin(), chosen.end());
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    return chosen;
}

// Minus twice the logarithm of the restricted likelihood at the likeliest variance, up to a constant.
// \param basis  orthonormal columns: what the parameters can change of the residuals.
double minus_two_log_likelihood(const VectorXd& residuals, const MatrixXd& basis, const MatrixXd& distances,
                                const ErrorCorrelation& correlation) {
    MatrixXd c = distances.unaryExpr([&](double d) { return correlation_at(correlation, d); });
    c.diagonal().setOnes();
    const Eigen::LLT<MatrixXd> factor(c);
    if (factor.info() != Eigen::Success) return kInfinity;
    const MatrixXd b = factor.matrixL().solve(basis);
    const VectorXd r = factor.matrixL().solve(residuals), g = b.transpose() * r;
    const Eigen::LLT<MatrixXd> h(b.transpose() * b);
    const auto log_root = [](const auto& llt) { return llt.matrixLLT().diagonal().array().log().sum(); };
    return 2.0 * log_root(factor) + 2.0 * log_root(h) +
           static_cast<double>(r.size() - b.cols()) *
               std::log(std::max(r.squaredNorm() - g.dot(h.solve(g)), 1e-300));
}

}  // namespace

double residual_variance(const LeastSquares& problem, double sum, double degrees, double noise) {
    if (problem.known_errors) return 1.0 + noise * noise;
    return std::max(noise * noise, degrees > 0.0 ? sum / degrees : 0.0);
}

void add_intervals(const LeastSquares& problem, LeastSquaresResult& result) {
    constexpr double kVanishing = 0.005;  // part of the strongest slope, up to which a slope vanishes
    const MatrixXd &slopes = result.slopes, &tested = result.tested;
    const Index count = result.residuals.size(), parameters = slopes.cols();
    const Eigen::JacobiSVD<MatrixXd> svd(tested.cols() > 0 ? MatrixXd(slopes * tested) : slopes,
                                         Eigen::ComputeThinU | Eigen::ComputeFullV);
    const VectorXd& strengths = svd.singularValues();
    result.correlation = find_correlation(result.residuals, slopes, problem.profiles);
    const CorrelatedErrors shared = correlated_errors(result.correlation, svd.matrixU(), problem.profiles);
    const SimulationNoise noise = simulation_noise(result, svd.matrixU());
    const bool estimated = !problem.known_errors && count > parameters, repeated = result.repeats.cols() > 1;
    // Degrees of freedom: the residuals do not show those correlated errors that the parameters absorb.
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
    // The noise of three close points may be too small by chance: take the scatter of points farther apart,
    // at most the spread over seeds, as any further scatter is the model's curvature.
    const double apart = std::max(
        result.noise,
        std::min(result.scatter, noise_over_seeds(result).norm() / std::sqrt(static_cast<double>(count))));
    const double hidden = 3.0 * apart * std::sqrt(2.0 * static_cast<double>(count)) / (2.0 * kMostDifference);
    // Residuals of a search that was cut short are no measure of errors.
    const bool reliable = result.converged || !problem.descends || problem.known_errors;
    MatrixXd unbounded = MatrixXd::Identity(parameters, parameters) - tested * tested.transpose();
    MatrixXd inverse = MatrixXd::Zero(parameters, strengths.size());  // pseudo-inverse of the slopes
    result.free_directions.clear();
    for (Index k = 0; k < tested.cols(); ++k) {
        const VectorXd direction = tested * svd.matrixV().col(k);
        const double slope = k < strengths.size() ? strengths[k] : 0.0;
        const bool vanishes = slope <= std::max(hidden, kVanishing * strengths[0]);
        // A direction is free, too, if its interval is as wide as the bounds.
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
    for (Index k = 0; k < parameters; ++k)
        result.half_interval[k] =
            half(of_targets(k, k), of_noise(k, k)) + std::sqrt(std::max(0.0, unbounded(k, k)));  // may be < 0
}

VectorXd noise_over_seeds(const LeastSquaresResult& result) {
    const MatrixXd spread = spread_over_seeds(result);
    return spread.cols() > 0 ? VectorXd(spread.rowwise().norm()) : VectorXd();
}

double student_quantile(double degrees) {
    // Without long double: Boost would compute with it at the program's start, and valgrind gives it no more
    // digits than a double.
    using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
    constexpr double kUpper = 0.975;
    return quantile(boost::math::students_t_distribution<double, Policy>(degrees), kUpper);
}

ErrorCorrelation find_correlation(const VectorXd& residuals, const MatrixXd& slopes,
                                  const std::vector<ProfileResiduals>& profiles) {
    constexpr std::size_t kMostPoints = 240;
    constexpr Index kFewPoints = 12;  // fewest points beyond the number of parameters
    constexpr double kAkaike = 4.0;   // Akaike's criterion: 2 for each of two more parameters
    std::vector<Index> rows;
    std::vector<Vector2d> places;
    std::vector<std::size_t> profile_of;
    for (std::size_t k = 0; k < profiles.size(); ++k)
        for (const std::size_t i : neighbours(profiles[k].points, kMostPoints / profiles.size())) {
            rows.push_back(profiles[k].first + static_cast<Index>(i));
            places.push_back(profiles[k].points[i]);
            profile_of.push_back(k);
        }
    const auto count = static_cast<Index>(rows.size());
    if (count < slopes.cols() + kFewPoints || residuals.isZero(0.0)) return {};
    double greatest = 0.0, nearest = kInfinity;
    const MatrixXd distances = MatrixXd::NullaryExpr(count, count, [&](Index i, Index j) {
        const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
        if (profile_of[a] != profile_of[b]) return kInfinity;
        const double d = (places[a] - places[b]).norm();
        greatest = std::max(greatest, d);
        if (d > 0.0) nearest = std::min(nearest, d);
        return d;
    });
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(slopes(rows, Eigen::all));
    const MatrixXd basis = qr.householderQ() * MatrixXd::Identity(count, qr.rank());
    const VectorXd chosen = residuals(rows);
    ErrorCorrelation best;
    double least = minus_two_log_likelihood(chosen, basis, distances, {1.0, 0.0}) - kAkaike;
    // Begin at a length at which most points have a neighbour; points that lie together count as one.
    for (double length = std::max(nearest, greatest / static_cast<double>(2 * count)); length <= greatest;
         length *= 1.5)
        for (const double shared : {0.2, 0.4, 0.6, 0.8, 0.95, 1.0})
            if (const double now = minus_two_log_likelihood(chosen, basis, distances, {length, shared});
                now < least) {
                least = now;
                best = {length, shared};
            }
    return best;
}

CorrelatedErrors correlated_errors(const ErrorCorrelation& correlation, const MatrixXd& basis,
                                   const std::vector<ProfileResiduals>& profiles) {
    CorrelatedErrors errors{.widening = basis.transpose() * basis};
    const auto count = static_cast<double>(basis.rows());
    double squares = count;  // sum of all correlations squared
    if (correlation.shared > 0.0)
        for (const ProfileResiduals& profile : profiles)
            for (std::size_t i = 0; i < profile.points.size(); ++i)
                for (std::size_t j = 0; j < i; ++j) {
                    const double c =
                        correlation_at(correlation, (profile.points[i] - profile.points[j]).norm());
                    const auto a = basis.row(profile.first + static_cast<Index>(i)),
                               b = basis.row(profile.first + static_cast<Index>(j));
                    errors.widening += c * (a.transpose() * b + b.transpose() * a);
                    squares += 2.0 * c * c;
                }
    errors.count = count * count / squares;
    return errors;
}

}  // namespace sidewall::app
