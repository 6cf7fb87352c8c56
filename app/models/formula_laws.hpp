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

// Names that the expressions of a `formula` step may use, and the values of expressions at a surface point.
namespace sidewall::app {

/// An expression with the key that holds it, which messages name.
struct Law {
    std::string key;
    Expression expression;
};

/// Values that expressions may name follow each other in one list: fluxes, coverages, then these.
enum class Extra : std::size_t { cos, x, y, z, depth, time, density, count };

/// The names in that list, and how to fill its values at a point.
struct Names {
    std::vector<std::string> fluxes, coverages;
    std::map<std::string, double> constants;  ///< parameters and pi
    Tables tables;
    Materials materials;
    std::vector<std::size_t> ions,
        ion_cosines;  ///< indices of fluxes: an ion species' arrivals; arrivals times cos

    /// \param flux  whether fluxes and cos may be named; if not, their names are "".
    std::vector<std::string> list(bool flux = true) const;
    std::size_t index(Extra extra) const {
        return fluxes.size() + coverages.size() + static_cast<std::size_t>(extra);
    }
    /// The values at a point, in a buffer of the calling thread that its next call overwrites.
    std::span<double> values(const SurfacePoint& point) const;
};

/// Adds \p name, which stands at \p key, to the names \p taken.
/// \throws KeyError if \p name is no identifier, is reserved or is taken.
void check_name(const std::string& key, const std::string& name, std::set<std::string>& taken);

/// Reads the expression that \p key holds.
/// \throws KeyError naming \p key and the character where \p text cannot be read.
Expression read_expression(const std::string& key, const std::string& text,
                           std::vector<std::string> variables, const Names& names);

/// The laws by material id; materials that are not named in \p expressions get its default.
/// \param key  key of the table, e.g. "rate".
/// \param flux  whether the laws may name fluxes and cos.
std::vector<Law> laws_by_material(const std::string& key, const Expressions& expressions, const Names& names,
                                  bool flux);

/// Value of a law for the list \p values.
/// \throws NumericsError with the law, the material and the values if it is not finite.
double evaluate(const Law& law, const Names& names, const SurfacePoint& point,
                std::span<const double> values);

/// The variables of a law with their values, e.g. "F = 0.3, theta = 0.1".
std::string named_values(const Law& law, const Names& names, std::span<const double> values);

/// Material and position of a point, e.g. "Si at (0.1, 0, -0.2)".
std::string place_of(const Names& names, const SurfacePoint& point, std::span<const double> values);

/// The laws of a step, read from its keys. "By coverage" is by index in names.coverages.
struct Formula {
    Names names;
    std::vector<Law> rate;                         ///< by material
    std::vector<std::vector<Law>> sticking;        ///< by species and material; empty for ions
    std::vector<std::vector<Law>> desorption;      ///< likewise; empty for species that do not desorb
    std::vector<std::optional<Law>> steady, slow;  ///< by coverage: its steady value, or its d/dt
    std::vector<std::size_t> ordered;              ///< steady coverages, each after those it names
    std::vector<std::size_t> coupled;              ///< steady coverages left: circular, or naming such
    std::vector<std::size_t> moving;               ///< coverages with a rate
    std::vector<std::optional<Law>> diffusion;     ///< by coverage: diffusivity D
    std::vector<std::uint8_t> diffuses_on;         ///< by material: whether coverages diffuse there
    bool grows = false;                            ///< whether the step names a film

    double& coverage(std::span<double> values, std::size_t k) const {
        return values[names.fluxes.size() + k];
    }
};

/// Advances the coverages \p theta at a point by \p time: those with a rate, then the steady ones.
/// \throws NumericsError with law, material and values where one is not finite or does not converge.
void react(const Formula& formula, const SurfacePoint& point, double time, std::span<double> theta);

/// d/dt of coverage \p k at a point, with the steady coverages in equilibrium with it.
/// \throws NumericsError as react does.
double coverage_rate(const Formula& formula, std::size_t k, const SurfacePoint& point);

/// Diffusivity of coverage \p k, which has a law of diffusion, at a point; 0 on materials without diffusion.
/// \throws NumericsError if it is not finite or negative.
double diffusivity(const Formula& formula, std::size_t k, const SurfacePoint& point);

/// f(theta), written to \p result, which has the length of \p theta.
using CoverageFunction = std::function<void(std::span<const double> theta, std::span<double> result)>;

/// Solves theta = f(theta), starting at \p theta, by Newton's method with a difference Jacobian; steps are
/// halved until the residual decreases.
/// \returns false if the residual does not fall to 1e-10; \p theta is then the last iterate.
bool solve_coverages(const CoverageFunction& f, std::span<double> theta);

/// Integrates d theta/dt = f(theta) over \p time by exponential Rosenbrock-Euler steps (Hochbruck and
/// Ostermann, Acta Numerica 19 (2010) 209): exact for linear f, stable for any rate. A step is halved until
/// it agrees with two half steps to 1e-7 (1 + theta).
/// \returns false after 10^4 steps, or if no step is small enough; \p theta is then where it stopped.
bool integrate_coverages(const CoverageFunction& f, double time, std::span<double> theta);

}  // namespace sidewall::app
