#include "flux/radiosity/solver.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

using Values = std::vector<double>;

// Least re-emitted share 1 - s: the flux is the emission divided by it, even where all sticks.
constexpr double kLeastReemitted = 1e-6;
// Fluxes below this share of the largest direct flux are not resolved any further.
constexpr double kFaint = 1e-7;
// Iterations until the coarse-grid correction is dropped: 10 times those of the deepest holes in the tests.
constexpr std::uint32_t kMostCorrected = 300;

double dot(const Values& a, const Values& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

void require_values(const std::string& name, const char* what, std::span<const double> values,
                    std::size_t wedges, double most) {
    if (values.size() != wedges)
        throw GeometryError("{}: {} values of {} for {} wedges: give one a wedge", name, values.size(), what,
                            wedges);
    for (const double value : values)
        if (!(value >= 0.0 && value <= most))
            throw RecipeError("{}: {} of a wedge = {}: must be {}", name, what, value,
                              most == 1.0 ? "in [0, 1]" : "at least 0");
}

struct Solved {
    Values emitted;  // (1 - s) flux, by unknown
    std::uint32_t iterations = 0;
};

// Preconditioned conjugate gradients on the balance, which is symmetric and positive semidefinite. They stop
// when the preconditioner would change the unknowns by less than the tolerance: relative to each unknown, or
// to \p faint if that is larger (below it rounding dominates), and averaged over the unknowns. A norm of the
// residual would not see deep places, at which little arrives, nor those where all sticks.
Solved conjugate_gradients(const Balance& balance, const CoarseGridSolver* coarse, const Values& right,
                           Values x, const Values& faint, double tolerance, const SolveOptions& options,
                           const std::string& name) {
    const std::size_t n = right.size();
    const std::span<const double> diagonal = balance.diagonal();
    const auto precondition = [&](const Values& r, Values& z) {
        for (std::size_t i = 0; i < n; ++i) z[i] = diagonal[i] > 0.0 ? r[i] / diagonal[i] : 0.0;
        if (coarse != nullptr) coarse->add_correction(r, diagonal, z);
    };
    const auto left_to_change = [&](const Values& z) {
        double sum = 0.0;
        for (std::size_t i = 0; i < n; ++i)
            if (z[i] != 0.0) sum += std::min(1.0, std::abs(z[i]) / std::max(std::abs(x[i]), faint[i]));
        return sum / static_cast<double>(n);
    };
    Values r(n), z(n), p(n), q(n);
    const double sources = dot(right, right);
    if (!std::isfinite(sources))
        throw NumericsError(name + ": what the source or the surface emits is not finite");
    if (!(sources > 0.0)) return {Values(n, 0.0), 0};
    balance.apply(x, r);
    for (std::size_t i = 0; i < n; ++i) r[i] = right[i] - r[i];
    precondition(r, z);
    p = z;
    double rz = dot(r, z), left = left_to_change(z);
    std::uint32_t iteration = 0;
    for (; !(left <= tolerance) || !std::isfinite(rz); ++iteration) {
        if (options.stop && options.stop()) throw Interrupted("interrupted while solving for " + name);
        if (iteration == options.most_iterations)
            throw NumericsError(
                "{}: after {} iterations the radiosity's solver still changes the flux by {:.2g} of "
                "itself, above {:.2g}: use monte-carlo",
                name, iteration, left, tolerance);
        if (iteration == kMostCorrected && coarse != nullptr) {  // restart without the correction
            coarse = nullptr;
            precondition(r, z);
            p = z;
            rz = dot(r, z);
        }
        balance.apply(p, q);
        const double curvature = dot(p, q);
        if (!(curvature > 0.0) || !std::isfinite(rz))
            throw NumericsError(
                "{}: the flux has no bound: nothing of it sticks in a part of the surface that no ray leaves",
                name);
        const double step = rz / curvature;
        for (std::size_t i = 0; i < n; ++i) {
            x[i] += step * p[i];
            r[i] -= step * q[i];
        }
        precondition(r, z);
        left = left_to_change(z);
        const double next = dot(r, z);
        for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + next / rz * p[i];
        rz = next;
    }
    return {std::move(x), iteration};
}

// Emission not to be resolved, by unknown: 1 - s times \p share of the largest flux of \p right alone.
Values faint_below(double share, const Balance& balance, const Values& right,
                   std::span<const double> reemitted) {
    const std::span<const double> diagonal = balance.diagonal();
    double brightest = 0.0;
    for (std::size_t i = 0; i < right.size(); ++i)
        if (diagonal[i] > 0.0)
            brightest = std::max(brightest, std::abs(right[i]) / (diagonal[i] * reemitted[i]));
    Values faint(reemitted.begin(), reemitted.end());
    for (double& value : faint) value *= share * brightest;
    return faint;
}

}  // namespace

std::vector<double> by_unknown(const Exchange::State& s, std::span<const double> wedge) {
    Values mean(s.profile.unknowns.count(), 0.0);
    for (std::size_t i = 0; i < wedge.size(); ++i) {
        const std::uint32_t u = s.profile.unknown[i];
        const double area = s.profile.unknowns.area[u];
        mean[u] += area > 0.0 ? s.wedges.area[i] / area * wedge[i] : wedge[i];
    }
    return mean;
}

Solver::Solver(const Exchange::State& state, const DiffuseSpecies& species, const SolveOptions& options)
    : s_(state), species_(species), options_(options) {
    const auto& exponents = state.source_exponents;
    if (std::find(exponents.begin(), exponents.end(), species.source_exponent) == exponents.end())
        throw RecipeError("{}: rays were gathered for no source exponent {}", species.name,
                          species.source_exponent);
    const std::size_t wedges = state.wedges.count();
    require_values(species.name, "sticking", species.sticking, wedges, 1.0);
    if (!species.emission.empty()) require_values(species.name, "emission", species.emission, wedges, 1e300);
    if (!species.guess.empty() && species.guess.size() != wedges)
        throw GeometryError("{}: {} guessed values for {} wedges", species.name, species.guess.size(),
                            wedges);
    if (!species.emission.empty()) emission_ = by_unknown(state, species.emission);
    Values ratio;
    for (const double s : by_unknown(state, species.sticking)) {
        reemitted_.push_back(std::max(kLeastReemitted, 1.0 - s));
        ratio.push_back(s / reemitted_.back());
    }
    absorption_ = absorption_matrix(state.mass, state.profile.unknowns.area, ratio);
    Eigen::MatrixXd exchange = state.aggregate_exchange.front();
    for (std::size_t k = 1; k < state.aggregate_exchange.size(); ++k) exchange += state.aggregate_exchange[k];
    coarse_.emplace(state.aggregates, state.scale(kAllGroups) * exchange, absorption_);
}

Solver::Answer Solver::solve(std::uint32_t groups, std::span<const double> guess, double tolerance) const {
    // With a single group, parts of the surface may lack exits; there the correction does not help.
    const CoarseGridSolver* coarse = std::popcount(groups) > 1 ? &*coarse_ : nullptr;
    const BalancedSamples& samples = s_.balanced(groups);
    const Balance balance(samples, absorption_);
    Values right = samples.direct(species_.source_exponent);
    for (double& value : right) value *= species_.source;
    if (!emission_.empty()) {
        const Values arriving = samples.arrivals(emission_);
        for (std::size_t i = 0; i < right.size(); ++i) right[i] += arriving[i];
    }
    Values start(right.size(), 0.0);
    if (!guess.empty()) start = by_unknown(s_, guess);
    for (std::size_t i = 0; i < start.size(); ++i) start[i] *= reemitted_[i];
    const Solved solved = conjugate_gradients(balance, coarse, right, std::move(start),
                                              faint_below(kFaint, balance, right, reemitted_), tolerance,
                                              options_, species_.name);
    Values flux(s_.wedges.count());
    for (std::size_t i = 0; i < flux.size(); ++i) {
        const std::uint32_t u = s_.profile.unknown[i];
        flux[i] = solved.emitted[u] / reemitted_[u];
    }
    return {std::move(flux), solved.iterations};
}

std::vector<Values> Solver::respond(const std::vector<Values>& rights, double tolerance) const {
    const Balance balance(s_.balanced(kAllGroups), absorption_);
    // Responses change sign; near their zeros they need no relative accuracy.
    constexpr double kFaintResponse = 1e-3;
    std::vector<Values> responses;
    responses.reserve(rights.size());
    for (const Values& right : rights)
        responses.push_back(
            conjugate_gradients(balance, &*coarse_, right, Values(right.size(), 0.0),
                                faint_below(kFaintResponse, balance, right, Values(right.size(), 1.0)),
                                tolerance, options_, species_.name)
                .emitted);
    return responses;
}

// With the emission u = (1 - s) flux, (absorption + M) u are the arrivals tested by the hat functions: M
// times their flux. Solves M error = (absorption + M) u - M flux by relaxation with the lumped M.
std::vector<double> Solver::absorption_error(std::span<const double> flux) const {
    constexpr int kRelaxations = 4;  // M and its lumped form differ by a factor of 4 at most
    const std::span<const double> area = s_.profile.unknowns.area;
    Values left(flux.size(), 0.0), error(flux.size(), 0.0);
    for (std::size_t i = 0; i < left.size(); ++i)
        for (WedgeMatrix::InnerIterator mass(s_.mass, i), own(absorption_, i); mass; ++mass, ++own) {
            const std::size_t j = mass.col();
            left[i] += ((own.value() + mass.value()) * reemitted_[j] - mass.value()) * flux[j];
        }
    for (int k = 0; k < kRelaxations; ++k) {
        const Values before = error;
        for (std::size_t i = 0; i < left.size(); ++i) {
            if (!(area[i] > 0.0)) continue;
            double rest = left[i];
            for (WedgeMatrix::InnerIterator mass(s_.mass, i); mass; ++mass)
                rest -= mass.value() * before[mass.col()];
            error[i] += rest / area[i];
        }
    }
    return error;
}

}  // namespace sidewall::flux
