#pragma once
#include <functional>
#include <span>

// Coverages that depend on each other, found by numbers.
namespace sidewall::app {

/// f(theta), written to \p result, which has the length of \p theta.
using CoverageFunction = std::function<void(std::span<const double> theta, std::span<double> result)>;

/// Solves theta = f(theta) from \p theta on: Newton's method with differences for derivatives, damped where a whole
/// step leads away.
/// \returns false if it does not settle to 1e-10; \p theta is then where it gave up.
bool solve_coverages(const CoverageFunction& f, std::span<double> theta);

/// Brings \p theta to what d theta/dt = f(theta) makes of it in \p time: exponential Rosenbrock-Euler steps (Hochbruck and
/// Ostermann, Acta Numerica 19 (2010) 209), exact where f is linear, stable for any rate, halved until two halves
/// agree with the whole to 1e-7.
/// \returns false if that takes over 10^4 steps or stops being finite; \p theta is then where it gave up.
bool integrate_coverages(const CoverageFunction& f, double time, std::span<double> theta);

}  // namespace sidewall::app
