#include "app/fit/correlation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector2d, Eigen::VectorXd;

double correlation_at(const ErrorCorrelation& correlation, double distance) {
    return correlation.shared * std::exp(-distance / correlation.length);
}

// Numbers of at most \p most points: all, or balls of neighbours, whose distances show how soon errors
// differ.
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

// Minus twice the logarithm of the restricted likelihood at the likeliest variance, but for a constant.
// \param basis  orthonormal columns: what the parameters can change of the residuals.
double unlikelihood(const VectorXd& residuals, const MatrixXd& basis, const MatrixXd& distances,
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

ErrorCorrelation find_correlation(const VectorXd& residuals, const MatrixXd& slopes,
                                  const std::vector<ProfileResiduals>& profiles) {
    constexpr std::size_t kMostPoints = 240;
    constexpr Index kFewPoints = 12;  // beyond the parameters
    constexpr double kAkaike = 4.0;   // two parameters more must be worth it
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
    double least = unlikelihood(chosen, basis, distances, {1.0, 0.0}) - kAkaike;
    // Points that lie together count as one: begin where most have a neighbour.
    for (double length = std::max(nearest, greatest / static_cast<double>(2 * count)); length <= greatest;
         length *= 1.5)
        for (const double shared : {0.2, 0.4, 0.6, 0.8, 0.95, 1.0})
            if (const double now = unlikelihood(chosen, basis, distances, {length, shared}); now < least) {
                least = now;
                best = {length, shared};
            }
    return best;
}

CorrelatedErrors correlated_errors(const ErrorCorrelation& correlation, const MatrixXd& basis,
                                   const std::vector<ProfileResiduals>& profiles) {
    CorrelatedErrors errors{.widening = basis.transpose() * basis};
    const auto count = static_cast<double>(basis.rows());
    double squares = count;  // of all correlations
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
