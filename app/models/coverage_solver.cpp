#include "app/models/coverage_solver.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

namespace sidewall::app {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

Vector value(const CoverageFunction& f, const Vector& theta) {
    Vector result(theta.size());
    f({theta.data(), static_cast<std::size_t>(theta.size())},
      {result.data(), static_cast<std::size_t>(result.size())});
    return result;
}

// df/dtheta by differences, where f(theta) = at.
Matrix jacobian(const CoverageFunction& f, const Vector& theta, const Vector& at) {
    constexpr double kDifference =
        1e-7;  // of coverages, which are of order 1: about the root of their rounding
    Matrix result(theta.size(), theta.size());
    Vector moved = theta;
    for (Eigen::Index k = 0; k < theta.size(); ++k) {
        moved[k] += kDifference;
        result.col(k) = (value(f, moved) - at) / kDifference;
        moved[k] = theta[k];
    }
    return result;
}

// theta after one step.
Vector exponential_step(const CoverageFunction& f, const Vector& theta, double time) {
    const Vector rate = value(f, theta);
    const Matrix slope = jacobian(f, theta, rate);
    if (theta.size() == 1) {
        const double z = time * slope(0, 0);
        return theta + rate * time * (z == 0.0 ? 1.0 : std::expm1(z) / z);
    }
    // The last column of exp [[h J, h f], [0, 0]] holds h phi_1(h J) f.
    const Eigen::Index n = theta.size();
    Matrix extended = Matrix::Zero(n + 1, n + 1);
    extended.topLeftCorner(n, n) = time * slope;
    extended.topRightCorner(n, 1) = time * rate;
    if (!extended.allFinite()) return Vector::Constant(n, std::numeric_limits<double>::quiet_NaN());
    const Matrix exponential = extended.exp();
    return theta + exponential.topRightCorner(n, 1);
}

}  // namespace

bool solve_coverages(const CoverageFunction& f, std::span<double> theta) {
    constexpr int kMostSteps = 100, kMostHalvings = 20;
    constexpr double kSettled = 1e-10;
    Eigen::Map<Vector> result(theta.data(), static_cast<Eigen::Index>(theta.size()));
    Vector at = result, image = value(f, at);
    for (int step = 0; step < kMostSteps && image.allFinite(); ++step) {
        const Vector residual = image - at;
        const double distance = residual.cwiseAbs().maxCoeff();
        if (distance <= kSettled) {
            result = image;
            return true;
        }
        const Matrix slope = Matrix::Identity(at.size(), at.size()) - jacobian(f, at, image);
        Vector change = slope.partialPivLu().solve(residual);
        if (!change.allFinite()) change = residual;
        Vector next = at + change, there = value(f, next);
        const auto closer = [&] { return (there - next).cwiseAbs().maxCoeff() < distance; };
        for (int halving = 0; halving < kMostHalvings && !(there.allFinite() && closer()); ++halving) {
            change *= 0.5;
            next = at + change;
            there = value(f, next);
        }
        at = next;
        image = there;
    }
    result = at;
    return false;
}

bool integrate_coverages(const CoverageFunction& f, double time, std::span<double> theta) {
    constexpr int kMostSteps = 10'000;
    constexpr double kAgreed = 1e-7;
    Eigen::Map<Vector> result(theta.data(), static_cast<Eigen::Index>(theta.size()));
    double done = 0.0, step = time;
    Vector at = result;
    const auto give_up = [&] {
        result = at;
        return false;
    };
    for (int count = 0; done < time; ++count) {
        if (count == kMostSteps) return give_up();
        step = std::min(step, time - done);
        const bool last = done + step >= time;
        const Vector whole = exponential_step(f, at, step);
        const Vector halves = exponential_step(f, exponential_step(f, at, 0.5 * step), 0.5 * step);
        const double error = (whole - halves).cwiseAbs().maxCoeff();
        if (halves.allFinite() && error <= kAgreed * (1.0 + halves.cwiseAbs().maxCoeff())) {
            at = halves;
            done = last ? time : done + step;
            step *= 2.0;
        } else {
            step *= 0.5;
            if (done + step == done) return give_up();
        }
    }
    result = at;
    return true;
}

}  // namespace sidewall::app
