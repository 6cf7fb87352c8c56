#include "app/models/formula_laws.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

const std::vector<std::string> kExtras = {"cos", "x", "y", "z", "depth", "time", "density"};

constexpr const char* kKeepAbove =
    "keep the arguments of roots, powers and logarithms above 0, as in sqrt(max(0, 1 - theta)): coverages "
    "may pass 0 or 1 by rounding";

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

Vector value(const CoverageFunction& f, const Vector& theta) {
    Vector result(theta.size());
    f({theta.data(), static_cast<std::size_t>(theta.size())},
      {result.data(), static_cast<std::size_t>(result.size())});
    return result;
}

// Jacobian df/dtheta by forward differences; \p at is f(theta).
Matrix jacobian(const CoverageFunction& f, const Vector& theta, const Vector& at) {
    constexpr double kDifference = 1e-7;  // coverages are of order 1: about the root of their rounding error
    Matrix result(theta.size(), theta.size());
    Vector moved = theta;
    for (Eigen::Index k = 0; k < theta.size(); ++k) {
        moved[k] += kDifference;
        result.col(k) = (value(f, moved) - at) / kDifference;
        moved[k] = theta[k];
    }
    return result;
}

// theta after one exponential Rosenbrock-Euler step of length `time`.
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

// Names with a fixed meaning in every formula, which nothing else may have.
const std::vector<std::string>& reserved_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all = kExtras;
        all.insert(all.end(), {"pi", "E", "default"});
        const auto& functions = expression_functions();
        all.insert(all.end(), functions.begin(), functions.end());
        return all;
    }();
    return names;
}

}  // namespace

void check_name(const std::string& key, const std::string& name, std::set<std::string>& taken) {
    if (!is_identifier(name))
        throw KeyError(key, "must be a name that expressions can use: letters, digits and _, no digit first");
    const auto& reserved = reserved_names();
    if (std::find(reserved.begin(), reserved.end(), name) != reserved.end())
        throw KeyError(key, name + " has a fixed meaning in expressions; choose another name");
    if (!taken.insert(name).second)
        throw KeyError(key, name +
                                " is the name of another species, yield, coverage or parameter; choose "
                                "another");
}

std::vector<std::string> Names::list(bool flux) const {
    std::vector<std::string> names = fluxes;
    if (!flux) std::fill(names.begin(), names.end(), std::string());
    names.insert(names.end(), coverages.begin(), coverages.end());
    names.insert(names.end(), kExtras.begin(), kExtras.end());
    if (!flux || ions.empty()) names[index(Extra::cos)].clear();
    return names;
}

std::span<double> Names::values(const SurfacePoint& point) const {
    static thread_local std::vector<double> buffer;
    buffer.assign(index(Extra::count), 0.0);
    std::copy(point.flux.begin(), point.flux.end(), buffer.begin());
    std::copy(point.coverage.begin(), point.coverage.end(),
              buffer.begin() + static_cast<std::ptrdiff_t>(fluxes.size()));
    const auto set = [&](Extra extra, double value) { buffer[index(extra)] = value; };
    if (!ion_cosines.empty() && !point.flux.empty()) {
        double arrivals = 0.0, cosines = 0.0;
        for (const std::size_t k : ions) arrivals += point.flux[k];
        for (const std::size_t k : ion_cosines) cosines += point.flux[k];
        set(Extra::cos, arrivals > 0.0 ? std::clamp(cosines / arrivals, 0.0, 1.0) : 1.0);
    }
    set(Extra::x, point.position.x());
    set(Extra::y, point.position.y());
    set(Extra::z, point.position.z());
    set(Extra::depth, -point.position.z());
    set(Extra::time, point.time);
    set(Extra::density, materials[static_cast<std::size_t>(point.material)].density);
    return buffer;
}

Expression read_expression(const std::string& key, const std::string& text,
                           std::vector<std::string> variables, const Names& names) {
    try {
        return {text, std::move(variables), names.constants, names.tables};
    } catch (const ExpressionError& error) {
        throw KeyError(key, error.what());
    }
}

std::vector<Law> laws_by_material(const std::string& key, const Expressions& expressions, const Names& names,
                                  bool flux) {
    std::map<std::string, Law> by_name;
    for (const auto& [name, text] : expressions.named) {
        const std::string path =
            expressions.named.size() == 1 && name == "default" ? key : fmt::format("{}.{}", key, name);
        by_name.insert({name, {path, read_expression(path, text, names.list(flux), names)}});
    }
    std::vector<Law> laws;
    for (const Material& material : names.materials) {
        const auto found = by_name.find(material.name);
        laws.push_back(found == by_name.end() ? by_name.at("default") : found->second);
    }
    return laws;
}

double evaluate(const Law& law, const Names& names, const SurfacePoint& point,
                std::span<const double> values) {
    const double value = law.expression(values);
    if (std::isfinite(value)) return value;
    throw NumericsError(
        "{} = \"{}\" is {} on {}, where {}: {}", law.key, law.expression.text(),
        std::isnan(value) ? "not a number" : "infinite", place_of(names, point, values),
        named_values(law, names, values),
        std::isnan(value) ? kKeepAbove : "keep its denominators away from 0 and its exponents small");
}

std::string named_values(const Law& law, const Names& names, std::span<const double> values) {
    const std::vector<std::string> list = names.list();
    std::vector<std::string> parts;
    for (const std::size_t k : law.expression.used())
        parts.push_back(fmt::format("{} = {:.6g}", list[k], values[k]));
    return parts.empty() ? "it depends on no variable" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string place_of(const Names& names, const SurfacePoint& point, std::span<const double> values) {
    std::string material = names.materials[static_cast<std::size_t>(point.material)].name;
    const auto at = [&](Extra extra) { return values[names.index(extra)]; };
    if (point.position.isZero()) return material;
    return fmt::format("{} at ({:.4g}, {:.4g}, {:.4g})", material, at(Extra::x), at(Extra::y), at(Extra::z));
}

namespace {

[[noreturn]] void refuse_unsettled(const Formula& formula, const SurfacePoint& point, const Law& law,
                                   std::span<const double> values) {
    throw NumericsError("{} = \"{}\" does not converge on {}, where {}", law.key, law.expression.text(),
                        place_of(formula.names, point, values), named_values(law, formula.names, values));
}

// Sets the steady coverages in the list of values, in equilibrium with the fluxes and the other coverages.
void settle(const Formula& formula, const SurfacePoint& point, std::span<double> values) {
    const auto value = [&](std::size_t k) {
        return evaluate(*formula.steady[k], formula.names, point, values);
    };
    for (const std::size_t k : formula.ordered) formula.coverage(values, k) = value(k);
    if (formula.coupled.empty()) return;
    std::vector<double> theta;
    for (const std::size_t k : formula.coupled) theta.push_back(formula.coverage(values, k));
    const auto put = [&](std::span<const double> at) {
        for (std::size_t i = 0; i < at.size(); ++i) formula.coverage(values, formula.coupled[i]) = at[i];
    };
    const CoverageFunction f = [&](std::span<const double> at, std::span<double> result) {
        put(at);
        for (std::size_t i = 0; i < at.size(); ++i)
            result[i] = formula.steady[formula.coupled[i]]->expression(values);
    };
    const bool settled = solve_coverages(f, theta);
    put(theta);
    if (settled) return;
    for (const std::size_t k : formula.coupled) value(k);  // names the law that is not finite
    refuse_unsettled(formula, point, *formula.steady[formula.coupled.front()], values);
}

// Throws if a rate law is undefined just beyond the coverages reached, as (1 - theta)^0.5 is at theta = 1.
void refuse_edge(const Formula& formula, const SurfacePoint& point, std::span<const double> theta,
                 std::span<const double> values, const CoverageFunction& rates) {
    constexpr double kBeyond = 1e-6;  // distance in coverage
    std::vector<double> moved(theta.begin(), theta.end()), rate(theta.size());
    for (std::size_t i = 0; i < theta.size(); ++i)
        for (const double step : {kBeyond, -kBeyond}) {
            moved[i] = theta[i] + step;
            rates(moved, rate);
            moved[i] = theta[i];
            for (std::size_t j = 0; j < rate.size(); ++j) {
                if (std::isfinite(rate[j])) continue;
                const Law& law = *formula.slow[formula.moving[j]];
                throw NumericsError(
                    "{} = \"{}\" cannot be integrated on {} beyond {}, where it is not a number: {}", law.key,
                    law.expression.text(), place_of(formula.names, point, values),
                    named_values(law, formula.names, values), kKeepAbove);
            }
        }
}

// Advances the coverages with a rate by `time`, with the steady ones in equilibrium throughout.
void move(const Formula& formula, const SurfacePoint& point, double time, std::span<double> values) {
    std::vector<double> theta;
    for (const std::size_t k : formula.moving) theta.push_back(formula.coverage(values, k));
    const auto put = [&](std::span<const double> at) {
        for (std::size_t i = 0; i < at.size(); ++i) formula.coverage(values, formula.moving[i]) = at[i];
    };
    const CoverageFunction f = [&](std::span<const double> at, std::span<double> result) {
        put(at);
        settle(formula, point, values);
        for (std::size_t i = 0; i < at.size(); ++i)
            result[i] = formula.slow[formula.moving[i]]->expression(values);
    };
    const bool moved = integrate_coverages(f, time, theta);
    put(theta);
    if (moved) return;
    for (const std::size_t k : formula.moving) evaluate(*formula.slow[k], formula.names, point, values);
    refuse_edge(formula, point, theta, values, f);
    refuse_unsettled(formula, point, *formula.slow[formula.moving.front()], values);
}

}  // namespace

void react(const Formula& formula, const SurfacePoint& point, double time, std::span<double> theta) {
    const std::span<double> values = formula.names.values(point);
    if (time > 0.0 && !formula.moving.empty()) move(formula, point, time, values);
    settle(formula, point, values);
    for (std::size_t k = 0; k < theta.size(); ++k) theta[k] = formula.coverage(values, k);
}

double coverage_rate(const Formula& formula, std::size_t k, const SurfacePoint& point) {
    const std::span<double> values = formula.names.values(point);
    settle(formula, point, values);
    return evaluate(*formula.slow[k], formula.names, point, values);
}

double diffusivity(const Formula& formula, std::size_t k, const SurfacePoint& point) {
    if (formula.diffuses_on[static_cast<std::size_t>(point.material)] == 0) return 0.0;
    const Law& law = *formula.diffusion[k];
    const std::span<const double> values = formula.names.values(point);
    const double d = evaluate(law, formula.names, point, values);
    if (d >= 0.0) return d;
    throw NumericsError("{} = \"{}\" is {:.6g} on {}, where {}: a diffusion coefficient must not be negative",
                        law.key, law.expression.text(), d, place_of(formula.names, point, values),
                        named_values(law, formula.names, values));
}

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
