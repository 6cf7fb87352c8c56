#pragma once
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "app/models/expression.hpp"
#include "app/models/model.hpp"

// The names that expressions of a `formula` step may use, and the values of expressions at a point of the
// surface.
namespace sidewall::app {

/// An expression and the key that holds it, for messages.
struct Law {
    std::string key;
    Expression expression;
};

/// The values that expressions name, in one list: every flux, every coverage, then these.
enum class Extra : std::size_t { cos, x, y, z, depth, time, density, count };

/// The names of that list, and how to fill it at a point.
struct Names {
    std::vector<std::string> fluxes, coverages;
    std::map<std::string, double> constants;  ///< parameters and pi
    Tables tables;
    Materials materials;
    std::vector<std::size_t> ions,
        ion_cosines;  ///< fluxes: arrivals of every ion species, and those times cos

    /// \param flux  whether fluxes and cos may be named; else their places have no name.
    std::vector<std::string> list(bool flux = true) const;
    std::size_t index(Extra extra) const {
        return fluxes.size() + coverages.size() + static_cast<std::size_t>(extra);
    }
    /// The values at a point, in a buffer of this thread that the next call overwrites.
    std::span<double> values(const SurfacePoint& point) const;
};

/// Adds \p name, which \p key gives, to those taken.
/// \throws KeyError unless expressions can use it and nothing else has it.
void check_name(const std::string& key, const std::string& name, std::set<std::string>& taken);

/// Reads the expression that \p key holds.
/// \throws KeyError naming \p key and the character where \p text cannot be read.
Expression read_expression(const std::string& key, const std::string& text,
                           std::vector<std::string> variables, const Names& names);

/// The law for every material, by id; materials that \p expressions leaves out have its default.
/// \param key  of the table, e.g. "rate".
std::vector<Law> laws_by_material(const std::string& key, const Expressions& expressions, const Names& names,
                                  bool flux);

/// The value of a law where the list holds \p values.
/// \throws NumericsError with the law, the material and the values if it is not finite.
double evaluate(const Law& law, const Names& names, const SurfacePoint& point,
                std::span<const double> values);

/// The names in a law with their values, e.g. "F = 0.3, theta = 0.1".
std::string named_values(const Law& law, const Names& names, std::span<const double> values);

/// The material and position of a point, e.g. "Si at (0.1, 0, -0.2)".
std::string place_of(const Names& names, const SurfacePoint& point, std::span<const double> values);

/// The laws of a step, read from its keys.
struct Formula {
    Names names;
    std::vector<Law> rate;                         ///< by material
    std::vector<std::vector<Law>> sticking;        ///< by species and material; none for ions
    std::vector<std::vector<Law>> desorption;      ///< the same; none for those that never do
    std::vector<std::optional<Law>> steady, slow;  ///< by coverage: its value, or d/dt of it
    std::vector<std::size_t> ordered;              ///< steady ones, each after those it names,
    std::vector<std::size_t> coupled;              ///< and those that name each other in turn
    std::vector<std::size_t> moving;               ///< those with a rate
    std::vector<std::optional<Law>> diffusion;     ///< by coverage: D
    std::vector<std::uint8_t> diffuses_on;         ///< by material
    bool grows = false;                            ///< a film is named

    double& coverage(std::span<double> values, std::size_t k) const {
        return values[names.fluxes.size() + k];
    }
};

/// Advances the coverages \p theta at a point by \p time: first the coverages with a rate, then the steady ones.
/// \throws NumericsError with the law, the material and the values where one is not finite or does not settle.
void react(const Formula& formula, const SurfacePoint& point, double time, std::span<double> theta);

/// The rate d/dt of coverage \p k at a point, with the steady coverages in equilibrium with it.
/// \throws as react.
double coverage_rate(const Formula& formula, std::size_t k, const SurfacePoint& point);

/// The diffusivity of coverage \p k, which has one, at a point.
/// \throws NumericsError if it is not finite or negative.
double diffusivity(const Formula& formula, std::size_t k, const SurfacePoint& point);

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
