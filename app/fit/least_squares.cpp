#include "app/fit/least_squares.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlopt.hpp>

#include "app/fit/fit_errors.hpp"
#include "app/sweep/vary.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

// Lengths in the unit box.
constexpr double kFirstRadius = 0.2, kLastRadius = 0.05, kLeastRadius = 0.01, kMostRadius = 0.5;
constexpr double kProbe = 0.004;     // distance of the points that show the noise
constexpr double kErrorPart = 0.05;  // in standard deviations: steps that gain less are not worth a run
constexpr double kCubic = 4.0;       // cubic coefficients over the typical slope
constexpr double kRoughness = 1e-4;  // noise over the typical slope, from which a model is rough
constexpr double kRough = 0.3, kFine = 0.02;  // allowed error of a slope over the typical slope

// Terms of a quadratic polynomial: 1, d_i, d_i d_j.
VectorXd terms(const VectorXd& d) {
    VectorXd all(1 + d.size() + d.size() * (d.size() + 1) / 2);
    all[0] = 1.0;
    all.segment(1, d.size()) = d;
    Index next = 1 + d.size();
    for (Index i = 0; i < d.size(); ++i)
        for (Index j = 0; j <= i; ++j) all[next++] = d[i] * d[j];
    return all;
}

// Quadratic polynomials of the residuals' change from the center.
struct Model {
    MatrixXd coefficients;  // a row a term, a column a residual
    MatrixXd covariance;    // of the slopes, all residuals together
    double slope = 0.0;     // typical slope
};

// The model's sum of squares at a step x, from the products of its coefficients.
double model_cost(unsigned n, const double* x, double*, void* gram) {
    const VectorXd t = terms(Eigen::Map<const VectorXd>(x, static_cast<Index>(n)));
    return t.dot(*static_cast<MatrixXd*>(gram) * t);
}

class Fitter {
  public:
    explicit Fitter(const LeastSquares& problem) : problem_(problem), parameters_(problem.start.size()) {}

    LeastSquaresResult fit() {
        samples_ = problem_.known;
        if (samples_.empty()) evaluate(first_points(problem_));
        center_ = lowest();
        if (!std::isfinite(center().cost()))
            throw NumericsError("no run of the first ones ended with all targets");
        measure_noise();
        LeastSquaresResult result{.converged = search()};
        take_lower();
        result.best = center().x;
        result.residuals = *center().residuals;
        result.noise = noise_;
        result.runs = samples_.size();
        const Model model = regress();
        const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(model.covariance);
        const Index tested = (axes.eigenvalues().array() < model.slope * model.slope).count();
        result.slopes = model.coefficients.middleRows(1, parameters_).transpose();
        result.scatter = scatter(model);
        result.tested = tested == parameters_ ? MatrixXd::Identity(parameters_, parameters_)
                                              : MatrixXd(axes.eigenvectors().leftCols(tested));
        add_intervals(problem_, result);
        return result;
    }

  private:
    const FitTrial& center() const { return samples_[center_]; }
    std::size_t left() const { return problem_.max_runs - std::min(problem_.max_runs, samples_.size()); }

    // Adds samples at points, as many as there are runs left.
    void evaluate(std::vector<BoxPoint> points) {
        points.resize(std::min(points.size(), left()));
        if (points.empty()) return;
        const std::vector<Residuals> residuals = problem_.evaluate(points);
        for (std::size_t i = 0; i < points.size(); ++i) samples_.push_back({points[i], residuals[i]});
    }

    std::size_t lowest() const {
        const auto least = std::ranges::min_element(samples_, {}, &FitTrial::cost);
        return static_cast<std::size_t>(least - samples_.begin());
    }

    // The number of residuals.
    double count() const { return static_cast<double>(center().residuals->size()); }

    // Standard deviation, due to noise, of the difference of two sums of squares.
    double sum_noise(double sum) const {
        const double noise = noise_ * noise_;
        return std::sqrt(8.0 * noise * sum + 4.0 * noise * noise * count());
    }

    double variance() const {
        return residual_variance(problem_, center().cost(), count() - static_cast<double>(parameters_),
                                 noise_);
    }

    // Moves the center to the lowest sample, unless noise or a step not worth a run explain its gain.
    void take_lower() {
        const double cost = center().cost();
        if (const std::size_t found = lowest();
            samples_[found].cost() < cost - 3.0 * sum_noise(cost) - kErrorPart * kErrorPart * variance())
            center_ = found;
    }

    // Noise by the second difference of three points on a line, so short that the model is linear along it.
    void measure_noise() {
        noise_ = problem_.noise.value_or(0.0);
        if (problem_.noise || left() < static_cast<std::size_t>(2 * parameters_ + 4)) return;
        const VectorXd inward =
            (center().x.array() < 0.5).select(VectorXd::Constant(parameters_, kProbe), -kProbe);
        evaluate({center().x + inward, center().x + 2.0 * inward});
        const FitTrial &one = samples_[samples_.size() - 2], &two = samples_.back();
        if (!std::isfinite(one.cost() + two.cost())) return;
        noise_ =
            (*center().residuals - 2.0 * *one.residuals + *two.residuals).norm() / std::sqrt(6.0 * count());
    }

    // Ridge regression of quadratic polynomials through the center. A sample's variance is that of the noise
    // at both points and of the cubic terms left out; quadratic coefficients are held to the typical slope.
    Model regress() const {
        constexpr double kWide = 10.0, kFloor = 1e-4, kNear = 0.2;
        double change = 0.0, distance = 0.0;
        for (const FitTrial& sample : samples_) {
            if (!std::isfinite(sample.cost())) continue;
            const double d2 = (sample.x - center().x).squaredNorm(), near = std::exp(-d2 / (kNear * kNear));
            change += near * (*sample.residuals - *center().residuals).squaredNorm();
            distance += near * d2;
        }
        Model model{.slope = change > 0.0 ? std::sqrt(change / distance) : 1.0};
        const double noise = noise_ * std::sqrt(2.0 * count());
        const Index size = terms(center().x).size();
        MatrixXd a = MatrixXd::Zero(static_cast<Index>(samples_.size()) + size, size);
        MatrixXd b = MatrixXd::Zero(a.rows(), center().residuals->size());
        for (Index i = 0; i < size; ++i)
            a(i, i) = 1.0 / (i <= parameters_ ? kWide * model.slope : model.slope);
        for (std::size_t i = 0; i < samples_.size(); ++i) {
            if (!std::isfinite(samples_[i].cost())) continue;
            const VectorXd d = samples_[i].x - center().x;
            const double rest = model.slope * (kCubic * std::pow(d.norm(), 3) + kFloor);
            const double weight = 1.0 / std::hypot(rest, i == center_ ? 0.0 : noise);
            a.row(size + static_cast<Index>(i)) = weight * terms(d);
            b.row(size + static_cast<Index>(i)) = weight * (*samples_[i].residuals - *center().residuals);
        }
        const Eigen::HouseholderQR<MatrixXd> qr(a);
        model.coefficients = qr.solve(b);
        const MatrixXd inverse =
            qr.matrixQR().topRows(size).triangularView<Eigen::Upper>().solve(MatrixXd::Identity(size, size));
        model.covariance =
            inverse.middleRows(1, parameters_) * inverse.middleRows(1, parameters_).transpose();
        return model;
    }

    // Standard deviation of the residuals about the model, for samples within kMostDifference of the center.
    double scatter(const Model& model) const {
        double sum = 0.0, degrees = -static_cast<double>(model.coefficients.rows());
        for (const FitTrial& sample : samples_) {
            const VectorXd d = sample.x - center().x;
            if (!std::isfinite(sample.cost()) || d.lpNorm<Eigen::Infinity>() > kMostDifference) continue;
            sum += (*sample.residuals - *center().residuals - model.coefficients.transpose() * terms(d))
                       .squaredNorm();
            degrees += 1.0;
        }
        return degrees > 0.0 ? std::sqrt(sum / (degrees * count())) : 0.0;
    }

    // Adds samples along directions whose slopes are less certain than asked for. False if there are none.
    bool spread(const Model& model, double length, double asked, bool both_sides) {
        const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(model.covariance);
        const double noise = noise_ * std::sqrt(0.5 * count());
        std::vector<BoxPoint> points;
        for (Index k = 0; k < parameters_; ++k) {
            const VectorXd along = axes.eigenvectors().col(k);
            const double slope = (model.coefficients.middleRows(1, parameters_).transpose() * along).norm();
            const double apart =
                std::clamp(10.0 * noise / std::max(slope, 0.1 * model.slope), length, kMostDifference);
            const double hoped = std::hypot(noise / apart, kCubic * model.slope * apart * apart);
            if (asked > 0.0 && std::sqrt(axes.eigenvalues()[k]) < std::max(asked * model.slope, 2.0 * hoped))
                continue;
            BoxPoint one = (center().x + apart * along).cwiseMax(0.0).cwiseMin(1.0),
                     other = (center().x - apart * along).cwiseMax(0.0).cwiseMin(1.0);
            if ((other - center().x).norm() > 1.001 * (one - center().x).norm()) std::swap(one, other);
            points.push_back(one);
            if (both_sides && (other - center().x).norm() > 0.2 * apart) points.push_back(other);
        }
        evaluate(points);
        return !points.empty();
    }

    // NLopt's minimum of the model's sum of squares within the box and the radius.
    VectorXd best_step(const Model& model, double radius, double& gain) const {
        constexpr double kDamping = 1e-7, kPrecision = 1e-5;
        MatrixXd all = model.coefficients;
        all.row(0) += *center().residuals;
        MatrixXd gram = all * all.transpose();
        for (Index i = 1; i <= parameters_; ++i) gram(i, i) += kDamping * model.slope * model.slope;
        std::vector<double> low(static_cast<std::size_t>(parameters_)), high = low, step = low;
        for (std::size_t i = 0; i < low.size(); ++i) {
            low[i] = -std::min(radius, center().x[static_cast<Index>(i)]);
            high[i] = std::min(radius, 1.0 - center().x[static_cast<Index>(i)]);
        }
        nlopt::opt search(nlopt::LN_BOBYQA, static_cast<unsigned>(parameters_));
        search.set_min_objective(model_cost, &gram);
        search.set_lower_bounds(low);
        search.set_upper_bounds(high);
        search.set_initial_step(0.25 * radius);
        search.set_xtol_abs(kPrecision);
        search.set_maxeval(static_cast<int>(200 * gram.rows()));
        double least = gram(0, 0);
        try {
            search.optimize(step, least);
        } catch (const nlopt::roundoff_limited&) {
        }
        gain = gram(0, 0) - least;
        return VectorXd::Map(step.data(), parameters_);
    }

    // Steps to minima of the model until one is not worth a run. False if the runs are used up.
    bool search() {
        double radius = kFirstRadius;
        std::size_t spread_at = problem_.max_runs;  // the center that has samples on both sides
        while (left() > 0) {
            take_lower();
            Model model = regress();
            if (!problem_.descends) return !spread(model, kLastRadius, kFine, true);
            if (spread_at != center_ && spread(model, 0.5 * radius, kRough, false)) {
                if (left() == 0) return false;
                take_lower();
                model = regress();
            }
            double gain = 0.0;
            const VectorXd step = best_step(model, radius, gain);
            const double length = step.lpNorm<Eigen::Infinity>();
            if (length <= kSearchTolerance || radius < kLeastRadius ||
                gain <= std::max(kErrorPart * kErrorPart * variance(), 1e-9 * model.slope * model.slope)) {
                // The slopes of a rough model differ around every center and are measured anew.
                const bool rough = spread_at < samples_.size() &&
                                   noise_ * std::sqrt(2.0 * count()) > kRoughness * model.slope;
                if (spread_at == center_ || left() <= static_cast<std::size_t>(2 * parameters_) ||
                    !spread(model, kLastRadius, rough ? 0.0 : kFine, true))
                    return true;
                spread_at = center_;
                radius = kLastRadius;
                continue;
            }
            const double before = center().cost();
            evaluate({center().x + step});
            const double gained = before - samples_.back().cost();
            if (gained > 0.0) center_ = samples_.size() - 1;
            if (gained > 0.5 * gain) radius = std::clamp(2.0 * length, kLastRadius, kMostRadius);
            if (gained < 0.1 * gain) radius *= 0.4;
        }
        return false;
    }

    const LeastSquares& problem_;
    Index parameters_;
    std::vector<FitTrial> samples_;
    std::size_t center_ = 0;  // the best sample, noise aside
    double noise_ = 0.0;
};

}  // namespace

double FitTrial::cost() const {
    return residuals && residuals->allFinite() ? residuals->squaredNorm() : kInfinity;
}

std::size_t count_first(Index parameters) {
    return static_cast<std::size_t>(2 * parameters + 3);
}

std::vector<BoxPoint> first_points(const LeastSquares& problem) {
    std::vector<BoxPoint> points{problem.start};
    const std::size_t more = std::min(count_first(problem.start.size()) - 1, problem.max_runs / 4);
    for (std::size_t i = 1; i <= more; ++i)
        points.push_back(BoxPoint::NullaryExpr(problem.start.size(), [&](Index d) {
            return sobol(static_cast<std::uint32_t>(i), static_cast<std::size_t>(d));
        }));
    return points;
}

LeastSquaresResult fit_least_squares(const LeastSquares& problem) {
    return Fitter(problem).fit();
}

}  // namespace sidewall::app
