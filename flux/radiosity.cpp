#include "flux/radiosity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "flux/exchange_state.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

using Values = std::vector<double>;

// Where all sticks nothing is re-emitted, and the flux is what is emitted of it over a share that must not be
// 0.
constexpr double kLeastReemitted = 1e-6;
// Fluxes below this share of the largest that arrives directly are not resolved any further.
constexpr double kFaint = 1e-7;

double dot(const Values& a, const Values& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

void require_values(const std::string& name, const char* what, std::span<const double> values,
                    std::size_t wedges, double most) {
    if (values.size() != wedges)
        throw GeometryError(fmt::format("{}: {} values of {} for {} wedges: give one a wedge", name,
                                        values.size(), what, wedges));
    for (const double value : values)
        if (!(value >= 0.0 && value <= most))
            throw RecipeError(fmt::format("{}: {} of a wedge = {}: must be {}", name, what, value,
                                          most == 1.0 ? "in [0, 1]" : "at least 0"));
}

struct Solved {
    Values emitted;  // (1 - s) flux, by wedge
    std::uint32_t iterations = 0;
};

// Conjugate gradients on the balance, which is symmetric and not negative. They stop when one more relaxation
// of every unknown by itself would change them by less than the tolerance, in the mean over the unknowns of
// what each changes relative to itself: a norm of all residuals would not see the deep places that little
// arrives at, nor those where all sticks. What lies below \p faint is compared with that instead: rounding
// bounds the rest.
Solved conjugate_gradients(const Balance& balance, const Values& right, Values x, const Values& faint,
                           double tolerance, const SolveOptions& options, const std::string& name) {
    const std::size_t n = right.size();
    const std::span<const double> diagonal = balance.diagonal();
    const auto precondition = [&](const Values& r, Values& z) {
        for (std::size_t i = 0; i < n; ++i) z[i] = diagonal[i] > 0.0 ? r[i] / diagonal[i] : 0.0;
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
            throw NumericsError(fmt::format(
                "{}: after {} iterations the radiosity's solver still changes the flux by {:.2g} of "
                "itself, above {:.2g}: use monte-carlo",
                name, iteration, left, tolerance));
        balance.apply(p, q);
        const double curvature = dot(p, q);
        if (!(curvature > 0.0) || !std::isfinite(rz))
            throw NumericsError(fmt::format(
                "{}: the flux has no bound: nothing of it sticks in a part of the surface that no ray leaves",
                name));
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

// The flux of one species from some of the groups.
class Solver {
  public:
    Solver(const Exchange::State& state, const DiffuseSpecies& species, const SolveOptions& options)
        : s_(state), species_(species), options_(options) {
        const auto& exponents = state.densities.exponents();
        if (std::find(exponents.begin(), exponents.end(), species.source_exponent) == exponents.end())
            throw RecipeError(fmt::format("{}: rays were gathered for no source exponent {}", species.name,
                                          species.source_exponent));
        const std::size_t wedges = state.wedges.count();
        require_values(species.name, "sticking", species.sticking, wedges, 1.0);
        if (!species.emission.empty())
            require_values(species.name, "emission", species.emission, wedges, 1e300);
        if (!species.guess.empty() && species.guess.size() != wedges)
            throw GeometryError(fmt::format("{}: {} guessed values for {} wedges", species.name,
                                            species.guess.size(), wedges));
        for (const double s : species.sticking) {
            reemitted_.push_back(std::max(kLeastReemitted, 1.0 - s));
            ratio_.push_back(s / reemitted_.back());
        }
    }

    struct Answer {
        Values flux;
        std::uint32_t iterations;
    };
    Answer solve(std::vector<const LinkGroup*> groups, const Values& guess, double tolerance) const {
        const double scale = 1.0 / (static_cast<double>(s_.group_rays) * static_cast<double>(groups.size()));
        const Balance balance(s_.wedges, s_.mass, ratio_, std::move(groups), scale);
        Values right = balance.direct(species_.source_exponent);
        for (double& value : right) value *= species_.source;
        if (!species_.emission.empty()) {
            const Values arriving = balance.arrivals(species_.emission);
            for (std::size_t i = 0; i < right.size(); ++i) right[i] += arriving[i];
        }
        Values start(right.size(), 0.0);
        for (std::size_t i = 0; i < guess.size(); ++i) start[i] = guess[i] * reemitted_[i];
        const std::span<const double> diagonal = balance.diagonal();
        double brightest = 0.0;
        for (std::size_t i = 0; i < right.size(); ++i)
            if (diagonal[i] > 0.0) brightest = std::max(brightest, right[i] / (diagonal[i] * reemitted_[i]));
        Values faint(reemitted_);
        for (double& value : faint) value *= kFaint * brightest;
        Solved solved =
            conjugate_gradients(balance, right, std::move(start), faint, tolerance, options_, species_.name);
        for (std::size_t i = 0; i < right.size(); ++i) solved.emitted[i] /= reemitted_[i];
        return {std::move(solved.emitted), solved.iterations};
    }

  private:
    const Exchange::State& s_;
    const DiffuseSpecies& species_;
    const SolveOptions& options_;
    Values reemitted_, ratio_;
};

// Means over triangles, or vertices, of a flux by wedge.
Values over_triangles(const Exchange::State& s, const Values& wedge) {
    Values mean(s.geometry.mesh.triangles.size());
    for (std::size_t t = 0; t < mean.size(); ++t)
        mean[t] = (wedge[s.wedges.corner[3 * t]] + wedge[s.wedges.corner[3 * t + 1]] +
                   wedge[s.wedges.corner[3 * t + 2]]) /
                  3.0;
    return mean;
}

Values over_vertices(const Exchange::State& s, const Values& wedge) {
    const Wedges& w = s.wedges;
    Values mean(s.geometry.mesh.vertices.size(), 0.0);
    for (std::size_t v = 0; v < mean.size(); ++v) {
        double area = 0.0;
        for (std::uint32_t i = w.first[v]; i < w.first[v + 1]; ++i) {
            area += w.area[i];
            mean[v] += w.area[i] * wedge[i];
        }
        if (area > 0.0) mean[v] /= area;
    }
    return mean;
}

// The mean's standard error from the groups' values.
Values standard_errors(const std::vector<Values>& groups) {
    const auto n = static_cast<double>(groups.size());
    Values error(groups.front().size());
    for (std::size_t i = 0; i < error.size(); ++i) {
        double mean = 0.0, squares = 0.0;
        for (const Values& group : groups) mean += group[i] / n;
        for (const Values& group : groups) squares += (group[i] - mean) * (group[i] - mean);
        error[i] = std::sqrt(squares / (n * (n - 1.0)));
    }
    return error;
}

double relative_error(const Wedges& wedges, const FluxField& vertex) {
    double error = 0.0, flux = 0.0;
    for (std::size_t v = 0; v < vertex.flux.size(); ++v)
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) {
            error += wedges.area[w] * vertex.error[v];
            flux += wedges.area[w] * vertex.flux[v];
        }
    return flux > 0.0 ? error / flux : error > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
}

}  // namespace

RadiosityFlux solve_flux(const Exchange& exchange, const DiffuseSpecies& species,
                         const SolveOptions& options) {
    const auto begin = std::chrono::steady_clock::now();
    const Exchange::State& s = exchange.state();
    if (s.rays == 0) throw RecipeError(species.name + ": no rays are gathered yet");
    const Solver solver(s, species, options);
    std::vector<const LinkGroup*> all;
    for (const LinkGroup& group : s.groups) all.push_back(&group);
    Solver::Answer whole = solver.solve(all, {species.guess.begin(), species.guess.end()}, options.tolerance);
    RadiosityFlux result;
    result.iterations = whole.iterations;
    result.wedge.flux = whole.flux;
    result.wedge.error.assign(whole.flux.size(), 0.0);
    result.triangle.error.assign(s.geometry.mesh.triangles.size(), 0.0);
    result.vertex.error.assign(s.geometry.mesh.vertices.size(), 0.0);
    if (options.errors) {
        std::vector<Values> wedge, triangle, vertex;
        for (const LinkGroup* group : all) {
            wedge.push_back(solver.solve({group}, whole.flux, std::max(1e-4, options.tolerance)).flux);
            triangle.push_back(over_triangles(s, wedge.back()));
            vertex.push_back(over_vertices(s, wedge.back()));
        }
        result.wedge.error = standard_errors(wedge);
        result.triangle.error = standard_errors(triangle);
        result.vertex.error = standard_errors(vertex);
        // The bias falls as 1 / rays: the two halves of the rays are off by twice the whole's.
        const std::vector<const LinkGroup*> lower(all.begin(), all.begin() + kLinkGroups / 2),
            upper(all.begin() + kLinkGroups / 2, all.end());
        const double tolerance = 10.0 * options.tolerance;
        const Values first = solver.solve(lower, whole.flux, tolerance).flux,
                     second = solver.solve(upper, whole.flux, tolerance).flux;
        for (std::size_t i = 0; i < whole.flux.size(); ++i)
            result.wedge.flux[i] = std::max(0.0, 2.0 * whole.flux[i] - 0.5 * (first[i] + second[i]));
    }
    result.triangle.flux = over_triangles(s, result.wedge.flux);
    result.vertex.flux = over_vertices(s, result.wedge.flux);
    result.relative_error = relative_error(s.wedges, result.vertex);
    double emitted = species.source * s.geometry.box.area(), absorbed = 0.0;
    for (std::size_t i = 0; i < whole.flux.size(); ++i) {
        absorbed += s.wedges.area[i] * species.sticking[i] * whole.flux[i];
        if (!species.emission.empty()) emitted += s.wedges.area[i] * species.emission[i];
    }
    result.absorbed = emitted > 0.0 ? std::clamp(absorbed / emitted, 0.0, 1.0) : 0.0;
    result.escaped = 1.0 - result.absorbed;
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return result;
}

}  // namespace sidewall::flux
