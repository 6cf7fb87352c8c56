#include "app/fit/least_squares.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "app/fit/fit_errors.hpp"
#include "app/sweep/sobol.hpp"
#include "surface/error.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

// Lengths in the unit box.
constexpr double kFirstRadius = 0.2, kLastRadius = 0.05, kLeastRadius = 0.01, kMostRadius = 0.5;
constexpr double kTolerance = 0.001;  // of a step
constexpr double kErrorPart = 0.05;   // or this part of the parameter's standard deviation
constexpr double kProbe = 0.004;      // between points that tell noise
constexpr double kSignal = 10.0;      // a slope's difference over the noise

struct Sample {
    BoxPoint x;
    VectorXd r;
    double cost;
};

// Steps within bounds that minimise |r + J d|^2, coordinate by coordinate.
VectorXd bounded_step(const MatrixXd& slopes, const VectorXd& r, const BoxPoint& at, double radius) {
    constexpr int kMostSweeps = 2000;
    constexpr double kDamping = 1e-6, kSettled = 1e-12;
    MatrixXd h = slopes.transpose() * slopes;
    const VectorXd g = slopes.transpose() * r;
    h.diagonal().array() += kDamping * h.diagonal().maxCoeff() + std::numeric_limits<double>::min();
    VectorXd step = VectorXd::Zero(at.size());
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        double moved = 0.0;
        for (Eigen::Index i = 0; i < at.size(); ++i) {
            const double wanted = step[i] - (g[i] + h.row(i).dot(step)) / h(i, i);
            const double low = std::max(-radius, -at[i]), high = std::min(radius, 1.0 - at[i]);
            const double now = std::clamp(wanted, low, high);
            moved = std::max(moved, std::abs(now - step[i]));
            step[i] = now;
        }
        if (moved < kSettled) break;
    }
    return step;
}

class Fitter {
  public:
    explicit Fitter(const LeastSquares& problem) : problem_(problem), parameters_(problem.start.size()) {}

    LeastSquaresResult fit() {
        explore();
        tell_noise();
        LeastSquaresResult result;
        result.converged = search();
        // A point that was evaluated for slopes alone may be lower.
        while (take_lower()) result.converged = search();
        result.best = best().x;
        result.residuals = best().r;
        result.noise = noise_;
        add_errors(problem_, slopes_, tested_directions(), result);
        result.runs = samples_.size();
        return result;
    }

  private:
    const Sample& best() const { return samples_[best_]; }
    std::size_t left() const { return problem_.max_runs - std::min(problem_.max_runs, samples_.size()); }

    // Adds samples, as many as may still be made, and returns the number of the first.
    std::size_t evaluate(std::vector<BoxPoint> points) {
        const std::size_t first = samples_.size();
        points.resize(std::min(points.size(), left()));
        if (points.empty()) return first;
        const std::vector<Residuals> residuals = problem_.evaluate(points);
        for (std::size_t i = 0; i < points.size(); ++i) add_sample(points[i], residuals[i]);
        return first;
    }

    void add_sample(const BoxPoint& x, const Residuals& residuals) {
        const bool found = residuals && residuals->allFinite();
        samples_.push_back(
            {x, found ? *residuals : VectorXd(), found ? residuals->squaredNorm() : kInfinity});
    }

    void take_best() {
        for (std::size_t i = 0; i < samples_.size(); ++i)
            if (samples_[i].cost < best().cost) best_ = i;
    }

    void explore() {
        for (const FitTrial& trial : problem_.known) add_sample(trial.x, trial.residuals);
        if (samples_.empty()) evaluate(first_points(problem_));
        take_best();
        if (!std::isfinite(best().cost))
            throw NumericsError("no run of the first ones ended with all targets");
    }

    // Goes to the lowest sample, if it is lower by more than three standard deviations of what noise makes of
    // a difference of sums, and than a step counts for that is left because it is short. False if there is
    // none.
    bool take_lower() {
        const double sum = best().cost, noise = noise_ * noise_,
                     by_noise = 3.0 * std::sqrt(8.0 * noise * sum +
                                                4.0 * noise * noise * static_cast<double>(best().r.size()));
        const double least = sum - by_noise - kErrorPart * kErrorPart * variance();
        const std::size_t before = best_;
        take_best();
        const bool lower = best().cost < least;
        if (lower)
            regress();
        else
            best_ = before;
        return lower;
    }

    // Three points in a row on a line so short that the model is straight along it.
    void tell_noise() {
        noise_ = problem_.noise.value_or(0.0);
        if (problem_.noise || left() < static_cast<std::size_t>(2 * parameters_ + 4)) return;
        VectorXd along = VectorXd::Constant(parameters_, kProbe);
        BoxPoint middle = best().x.cwiseMax(kProbe).cwiseMin(1.0 - kProbe);
        const bool inside = middle == best().x;
        std::vector<BoxPoint> points{middle - along, middle + along};
        if (!inside) points.push_back(middle);
        const std::size_t before = best_, first = evaluate(points);
        const VectorXd& r = inside ? samples_[before].r : samples_.back().r;
        if (samples_.size() < first + 2 || r.size() == 0) return;
        if (samples_[first].r.size() == r.size() && samples_[first + 1].r.size() == r.size()) {
            // The second difference of independent errors has 1 + 4 + 1 times their variance.
            const VectorXd second = samples_[first].r - 2.0 * r + samples_[first + 1].r;
            noise_ = std::sqrt(second.squaredNorm() / (6.0 * static_cast<double>(r.size())));
        }
        take_best();
    }

    // How far apart points must be along a direction for the noise not to hide its slope.
    double difference_along(const VectorXd& direction, double radius) const {
        double least = 0.5 * radius;
        if (slopes_.size() > 0) {
            const double signal = (slopes_ * direction).norm();
            const double noise = noise_ * std::sqrt(2.0 * static_cast<double>(best().r.size()));
            least = std::max(least, signal > 0.0 ? kSignal * noise / signal : kMostDifference);
        }
        return std::min(least, kMostDifference);
    }

    BoxPoint beside(const VectorXd& direction, double length) const {
        const auto room = [&](double sign) {
            const BoxPoint end = (best().x + sign * length * direction).cwiseMax(0.0).cwiseMin(1.0);
            return (end - best().x).eval();
        };
        const VectorXd one = room(1.0), other = room(-1.0);
        return best().x + (one.norm() >= (1.0 - 1e-9) * other.norm() ? one : other);
    }

    // The samples within a distance of the best one, and those made last for slopes there.
    std::vector<std::size_t> near(double distance) const {
        std::vector<std::size_t> chosen;
        for (std::size_t i = 0; i < samples_.size(); ++i) {
            if (i == best_ || samples_[i].r.size() == 0) continue;
            const double apart = (samples_[i].x - best().x).lpNorm<Eigen::Infinity>();
            if (apart <= distance || (i >= fresh_ && apart <= 2.0 * kMostDifference)) chosen.push_back(i);
        }
        return chosen;
    }

    // Adds samples where the near ones leave a direction open.
    void spread(double radius) {
        MatrixXd cover = MatrixXd::Zero(parameters_, parameters_);
        for (const std::size_t i : near(2.0 * radius)) {
            VectorXd d = (samples_[i].x - best().x) / (0.5 * radius);
            d /= std::max(1.0, d.norm());
            cover += d * d.transpose();
        }
        constexpr double kOpen = 0.4;
        const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(cover);
        std::vector<BoxPoint> points;
        for (Eigen::Index k = 0; k < parameters_; ++k) {
            const VectorXd direction = axes.eigenvectors().col(k);
            if (axes.eigenvalues()[k] < kOpen)
                points.push_back(beside(direction, difference_along(direction, radius)));
        }
        if (!points.empty()) fresh_ = samples_.size();
        evaluate(points);
    }

    // Slopes at the best sample by a regression. A sample's weight comes from the noise and from what its
    // change is off a straight line, which grows with its distance. Directions without samples get none.
    void regress() {
        constexpr double kCurvature = 0.5, kLeast = 1e-6;
        const std::vector<std::size_t> chosen = near(2.0 * kMostDifference);
        const auto rows = static_cast<Eigen::Index>(chosen.size());
        const double noise = 2.0 * noise_ * noise_ * static_cast<double>(best().r.size());
        double greatest = std::numeric_limits<double>::min();
        for (const std::size_t i : chosen) greatest = std::max(greatest, (samples_[i].r - best().r).norm());
        MatrixXd a(rows, parameters_), b(rows, best().r.size());
        for (Eigen::Index i = 0; i < rows; ++i) {
            const Sample& sample = samples_[chosen[static_cast<std::size_t>(i)]];
            const VectorXd d = sample.x - best().x, change = sample.r - best().r;
            const double bent = kCurvature * d.norm() * change.norm();
            const double weight = 1.0 / std::sqrt(noise + bent * bent + std::pow(kLeast * greatest, 2));
            a.row(i) = weight * d.transpose();
            b.row(i) = weight * change.transpose();
        }
        slopes_ = rows == 0 ? MatrixXd::Zero(best().r.size(), parameters_)
                            : MatrixXd(a.completeOrthogonalDecomposition().solve(b).transpose());
    }

    double variance() const {
        const auto degrees = static_cast<double>(best().r.size() - parameters_);
        return residual_variance(problem_, best().cost, degrees, noise_);
    }

    bool settled(const VectorXd& step) const {
        const MatrixXd h = slopes_.transpose() * slopes_;
        const MatrixXd covariance = variance() * h.completeOrthogonalDecomposition().pseudoInverse();
        const VectorXd error = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
        return (step.cwiseAbs().array() <= (kErrorPart * error).cwiseMax(kTolerance).array()).all();
    }

    // Slopes at the best sample by central differences: what a regression takes from farther points, where
    // the model is bent, may end in a valley beside the minimum. False if there are no runs left for that, or
    // no room.
    bool look_from_both_sides() {
        std::vector<BoxPoint> points;
        std::vector<double> lengths;
        for (Eigen::Index i = 0; i < parameters_; ++i) {
            const double room = std::min(best().x[i], 1.0 - best().x[i]);
            lengths.push_back(std::min(room, difference_along(VectorXd::Unit(parameters_, i), kLastRadius)));
            if (lengths.back() < kLeastRadius) return false;
            for (const double sign : {-1.0, 1.0})
                points.push_back(best().x + sign * lengths.back() * VectorXd::Unit(parameters_, i));
        }
        if (left() < points.size() + 1) return false;
        const std::size_t first = fresh_ = evaluate(points);
        for (std::size_t i = first; i < samples_.size(); ++i)
            if (samples_[i].r.size() == 0) return false;
        for (Eigen::Index i = 0; i < parameters_; ++i) {
            const std::size_t low = first + 2 * static_cast<std::size_t>(i);
            slopes_.col(i) =
                (samples_[low + 1].r - samples_[low].r) / (2.0 * lengths[static_cast<std::size_t>(i)]);
        }
        return true;
    }

    // False if the runs are used up.
    bool search() {
        const bool ended = problem_.descends && descend();
        if (slopes_.size() == 0) regress();
        if (!problem_.descends) look_from_both_sides();
        look_at_weak_directions();
        return ended;
    }

    // False if the runs are used up.
    bool descend() {
        double radius = kFirstRadius;
        bool from_both_sides = false;              // the slopes at hand
        std::size_t stuck_at = problem_.max_runs;  // the best sample when steps last led nowhere
        while (left() > 0) {
            if (!from_both_sides) {
                spread(radius);
                take_best();
                regress();
            }
            const VectorXd step = bounded_step(slopes_, best().r, best().x, radius);
            if (settled(step)) {
                if (from_both_sides) return true;
                if (radius > kLastRadius) {
                    radius = std::max(kLastRadius, 0.25 * radius);
                } else {
                    from_both_sides = look_from_both_sides();
                    if (!from_both_sides) return true;
                }
                continue;
            }
            from_both_sides = false;
            if (left() == 0) return false;
            radius = try_step(step, radius);
            if (radius >= kLeastRadius) continue;
            // What is left is noise, or slopes from one side are wrong by the curvature.
            if (stuck_at == best_ || !look_from_both_sides()) return true;
            stuck_at = best_;
            from_both_sides = true;
            radius = kLastRadius;
        }
        return false;
    }

    // The radius of the next step.
    double try_step(const VectorXd& step, double radius) {
        const double before = best().cost, length = step.lpNorm<Eigen::Infinity>();
        const double predicted = before - (best().r + slopes_ * step).squaredNorm();
        const double gained = before - samples_[evaluate({best().x + step})].cost;
        take_best();
        if (gained > 0.5 * predicted) return std::clamp(2.0 * length, kLastRadius, kMostRadius);
        return gained < 0.1 * predicted ? 0.4 * radius : radius;
    }

    // Slopes from one side are wrong by the curvature: where they are small by comparison, from both sides.
    void look_at_weak_directions() {
        constexpr double kWeak = 0.1;
        const Eigen::JacobiSVD<MatrixXd> svd(slopes_, Eigen::ComputeThinU | Eigen::ComputeFullV);
        for (Eigen::Index k = 0; k < parameters_; ++k) {
            const double strength = k < svd.singularValues().size() ? svd.singularValues()[k] : 0.0;
            if (strength > kWeak * svd.singularValues()[0] || left() < 2) continue;
            const VectorXd direction = svd.matrixV().col(k);
            double length = kMostDifference;
            for (Eigen::Index i = 0; i < parameters_; ++i)
                if (const double room = std::min(best().x[i], 1.0 - best().x[i]); direction[i] != 0.0)
                    length = std::min(length, room / std::abs(direction[i]));
            if (length < kLastRadius) continue;
            const std::size_t first =
                evaluate({best().x - length * direction, best().x + length * direction});
            const VectorXd &low = samples_[first].r, &high = samples_[first + 1].r;
            if (low.size() == 0 || high.size() == 0) continue;
            slopes_ += ((high - low) / (2.0 * length) - slopes_ * direction) * direction.transpose();
        }
    }

    // Directions along which samples near the best one lie, farther than those that tell noise; columns.
    MatrixXd tested_directions() const {
        const std::vector<std::size_t> chosen = near(2.0 * kMostDifference);
        if (chosen.empty()) return MatrixXd(parameters_, 0);
        MatrixXd apart(static_cast<Eigen::Index>(chosen.size()), parameters_);
        for (Eigen::Index i = 0; i < apart.rows(); ++i)
            apart.row(i) = samples_[chosen[static_cast<std::size_t>(i)]].x - best().x;
        const Eigen::JacobiSVD<MatrixXd> svd(apart, Eigen::ComputeThinU | Eigen::ComputeFullV);
        const double least = 2.0 * kProbe * std::sqrt(static_cast<double>(parameters_));
        const Eigen::Index count = (svd.singularValues().array() > least).count();
        if (count == parameters_) return MatrixXd::Identity(parameters_, parameters_);
        return svd.matrixV().leftCols(count);
    }

    const LeastSquares& problem_;
    Eigen::Index parameters_;
    std::vector<Sample> samples_;
    std::size_t best_ = 0, fresh_ = 0;  // and the first of those that were made last for slopes
    MatrixXd slopes_;                   // of the residuals at the best sample
    double noise_ = 0.0;
};

}  // namespace

std::vector<BoxPoint> first_points(const LeastSquares& problem) {
    std::vector<BoxPoint> points{problem.start};
    const auto dimensions = static_cast<std::size_t>(problem.start.size());
    const std::size_t more = std::min(2 * dimensions + 2, problem.max_runs / 4);
    for (std::size_t i = 1; i <= more; ++i) {
        BoxPoint point(problem.start.size());
        for (std::size_t d = 0; d < dimensions; ++d)
            point[static_cast<Eigen::Index>(d)] = sobol(static_cast<std::uint32_t>(i), d);
        points.push_back(std::move(point));
    }
    return points;
}

LeastSquaresResult fit_least_squares(const LeastSquares& problem) {
    return Fitter(problem).fit();
}

}  // namespace sidewall::app
