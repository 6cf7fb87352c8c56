#include "app/fit/correlation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace sidewall::app {
namespace {

using Eigen::MatrixXd, Eigen::Vector2d, Eigen::VectorXd;

constexpr std::size_t kMostPoints = 240, kBalls = 3;
constexpr Eigen::Index kFewPoints = 12;  // beyond the parameters
constexpr double kAkaike = 4.0;
constexpr std::array kShared{0.2, 0.4, 0.6, 0.8, 0.95, 1.0};

double alike(const ErrorCorrelation& correlation, double distance) {
    return correlation.shared * std::exp(-distance / correlation.length);
}

// Points of one profile, the nearest to some that are spread over the list, by their numbers in it.
std::vector<std::size_t> neighbours(const std::vector<Vector2d>& points, std::size_t most) {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (points.size() <= most) return order;
    std::vector<std::size_t> chosen;
    for (std::size_t ball = 0; ball < kBalls; ++ball) {
        const Vector2d& middle = points[(2 * ball + 1) * points.size() / (2 * kBalls)];
        const auto count = static_cast<std::ptrdiff_t>(most / kBalls);
        std::partial_sort(order.begin(), order.begin() + count, order.end(),
                          [&](std::size_t a, std::size_t b) {
                              return (points[a] - middle).squaredNorm() < (points[b] - middle).squaredNorm();
                          });
        chosen.insert(chosen.end(), order.begin(), order.begin() + count);
    }
    std::sort(chosen.begin(), chosen.end());
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    return chosen;
}

// What the likelihood is found from: distances between points, infinite between profiles.
struct Looked {
    VectorXd residuals;
    MatrixXd basis, distances;  // basis: orthonormal, of what the parameters can change
};

Looked look_at(const VectorXd& residuals, const MatrixXd& slopes,
               const std::vector<ProfileResiduals>& profiles) {
    std::vector<Eigen::Index> rows;
    std::vector<std::pair<std::size_t, Vector2d>> places;
    for (std::size_t k = 0; k < profiles.size(); ++k)
        for (const std::size_t i :
             neighbours(profiles[k].points, std::max(kBalls, kMostPoints / profiles.size()))) {
            rows.push_back(profiles[k].first + static_cast<Eigen::Index>(i));
            places.emplace_back(k, profiles[k].points[i]);
        }
    Looked looked{.residuals = residuals(rows)};
    const auto count = static_cast<Eigen::Index>(rows.size());
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(slopes(rows, Eigen::all));
    looked.basis = MatrixXd(qr.householderQ() * MatrixXd::Identity(count, std::min(qr.rank(), count)));
    looked.distances = MatrixXd::Constant(count, count, std::numeric_limits<double>::infinity());
    for (Eigen::Index i = 0; i < count; ++i)
        for (Eigen::Index j = 0; j <= i; ++j) {
            const auto &a = places[static_cast<std::size_t>(i)], &b = places[static_cast<std::size_t>(j)];
            if (a.first == b.first) looked.distances(i, j) = (a.second - b.second).norm();
        }
    return looked;
}

// Minus twice the logarithm of the restricted likelihood, but for a constant, of the likeliest variance.
// \param c  storage for the correlations, kept from call to call.
double unlikelihood(const Looked& looked, const ErrorCorrelation& correlation, MatrixXd& c) {
    c = looked.distances.unaryExpr([&](double d) { return alike(correlation, d); });
    c.diagonal().setOnes();
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(c);
    if (factor.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const auto lower = factor.matrixL();
    const MatrixXd b = lower.solve(looked.basis);
    const VectorXd r = lower.solve(looked.residuals);
    const Eigen::LLT<MatrixXd> h(b.transpose() * b);
    const VectorXd g = b.transpose() * r;
    const double sum = r.squaredNorm() - g.dot(h.solve(g));
    const auto degrees = static_cast<double>(r.size() - b.cols());
    const auto log_root = [](const auto& llt) { return llt.matrixLLT().diagonal().array().log().sum(); };
    return 2.0 * log_root(factor) + 2.0 * log_root(h) +
           degrees * std::log(std::max(sum, std::numeric_limits<double>::min()));
}

}  // namespace

ErrorCorrelation find_correlation(const VectorXd& residuals, const MatrixXd& slopes,
                                  const std::vector<ProfileResiduals>& profiles) {
    ErrorCorrelation best;
    if (profiles.empty() || residuals.isZero(0.0)) return best;
    const Looked looked = look_at(residuals, slopes, profiles);
    if (looked.residuals.size() < slopes.cols() + kFewPoints) return best;
    double greatest = 0.0, nearest = std::numeric_limits<double>::infinity();
    for (const double d : looked.distances.reshaped()) {
        if (std::isfinite(d)) greatest = std::max(greatest, d);
        if (d > 0.0) nearest = std::min(nearest, d);
    }
    // Points that lie together are as one that was counted twice: begin where most have a neighbour.
    nearest = std::max(nearest, greatest / static_cast<double>(2 * looked.residuals.size()));
    MatrixXd storage;
    // Akaike: two further parameters must make the residuals likelier by as much.
    double least = unlikelihood(looked, {1.0, 0.0}, storage) - kAkaike;
    for (double length = nearest; length <= greatest; length *= 1.5)
        for (const double shared : kShared)
            if (const double now = unlikelihood(looked, {length, shared}, storage); now < least) {
                least = now;
                best = {length, shared};
            }
    return best;
}

CorrelatedErrors correlated_errors(const ErrorCorrelation& correlation, const MatrixXd& basis,
                                   const std::vector<ProfileResiduals>& profiles) {
    CorrelatedErrors errors{.widening = basis.transpose() * basis};
    double squares = static_cast<double>(basis.rows());  // of all correlations
    if (correlation.shared > 0.0)
        for (const ProfileResiduals& profile : profiles)
            for (std::size_t i = 0; i < profile.points.size(); ++i)
                for (std::size_t j = 0; j < i; ++j) {
                    const double c = alike(correlation, (profile.points[i] - profile.points[j]).norm());
                    const auto a = basis.row(profile.first + static_cast<Eigen::Index>(i)),
                               b = basis.row(profile.first + static_cast<Eigen::Index>(j));
                    errors.widening += c * (a.transpose() * b + b.transpose() * a);
                    squares += 2.0 * c * c;
                }
    errors.count = std::pow(static_cast<double>(basis.rows()), 2) / squares;
    return errors;
}

}  // namespace sidewall::app
