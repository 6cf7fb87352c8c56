#include "flux/radiosity/radiosity.hpp"

#include <array>
#include <chrono>
#include <cmath>

#include "flux/radiosity/solver.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

using Values = std::vector<double>;

// Means over triangles of a flux by wedge.
Values over_triangles(const Exchange::State& s, const Values& wedge) {
    Values mean(s.geometry.mesh.triangles.size());
    for (std::size_t t = 0; t < mean.size(); ++t)
        mean[t] = (wedge[s.wedges.corner[3 * t]] + wedge[s.wedges.corner[3 * t + 1]] +
                   wedge[s.wedges.corner[3 * t + 2]]) /
                  3.0;
    return mean;
}

// Means over vertices of a flux by wedge, weighted by area.
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

// Halves of the eight groups of rays, a bit a group; their complements are the other halves. Any two of these
// halves have half of their groups in common.
constexpr std::uint32_t kHalves[] = {0x0f, 0x33, 0x55};

// Standard errors of the flux of all rays, from squared differences between the fluxes of halves.
struct ErrorSums {
    Values wedge, triangle, vertex;
    void add(const Exchange::State& s, const Values& difference) {
        const auto add_squares = [](Values& sum, const Values& values) {
            sum.resize(values.size(), 0.0);
            for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += values[i] * values[i];
        };
        add_squares(wedge, difference);
        add_squares(triangle, over_triangles(s, difference));
        add_squares(vertex, over_vertices(s, difference));
    }
    void put(double scale, RadiosityFlux& result) {
        for (Values* sum : {&wedge, &triangle, &vertex})
            for (double& value : *sum) value = std::sqrt(scale * value);
        result.wedge.error = std::move(wedge);
        result.triangle.error = std::move(triangle);
        result.vertex.error = std::move(vertex);
    }
};

Values difference(const Values& one, const Values& other) {
    Values d(one.size());
    for (std::size_t i = 0; i < d.size(); ++i) d[i] = one[i] - other[i];
    return d;
}

// Mean error over the mean flux of the vertices whose flux depends on rays. Open planes, which exchange
// nothing, have none and would hide that of a hole beside them.
double statistical_error(const Wedges& wedges, const FluxField& vertex) {
    double error = 0.0, flux = 0.0;
    for (std::size_t v = 0; v < vertex.flux.size(); ++v)
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1] && vertex.error[v] > 0.0; ++w) {
            error += wedges.area[w] * vertex.error[v];
            flux += wedges.area[w] * vertex.flux[v];
        }
    return flux > 0.0 ? error / flux : error > 0.0 ? kInfinity : 0.0;
}

// Error of the linear elements relative to the flux. \p one, other: fluxes from two halves of the rays.
double discretisation_error(const Exchange::State& s, const DiffuseSpecies& species, const Solver& solver,
                            const Values& flux, const Values& one, const Values& other) {
    const TriangleMesh& mesh = s.geometry.mesh;
    const Values bends = expected_bends(mesh, s.wedges, flux);
    const auto emitted = [&](const Values& by_wedge) {
        Values by = by_unknown(s, by_wedge);
        for (std::size_t i = 0; i < by.size(); ++i) by[i] *= solver.reemitted()[i];
        if (species.emission.empty()) return by;
        const Values own = by_unknown(s, species.emission);
        for (std::size_t i = 0; i < own.size(); ++i) by[i] += own[i];
        return by;
    };
    const double factor = bend_factor(s.geometry, s.profile, s.residual, bends, emitted(one), emitted(other),
                                      species.source, species.source_exponent);
    const Values expected = errors_of(bends);
    const Values absorption = solver.absorption_error(by_unknown(s, flux));
    double bent = 0.0, absorbed = 0.0, sum = 0.0;
    for (std::size_t t = 0; t < expected.size(); ++t) bent += triangle_area(mesh, t) * expected[t];
    for (std::size_t w = 0; w < flux.size(); ++w) {
        absorbed += s.wedges.area[w] * std::abs(absorption[s.profile.unknown[w]]);
        sum += s.wedges.area[w] * flux[w];
    }
    return sum > 0.0 ? std::hypot(factor * bent, absorbed) / sum : 0.0;
}

}  // namespace

RadiosityFlux solve_flux(const Exchange& exchange, const DiffuseSpecies& species,
                         const SolveOptions& options) {
    const auto begin = std::chrono::steady_clock::now();
    const Exchange::State& s = exchange.state();
    if (s.rays == 0) throw RecipeError(species.name + ": no rays are gathered yet");
    const Solver solver(s, species, options);
    Solver::Answer whole = solver.solve(kAllGroups, species.guess, options.tolerance);
    RadiosityFlux result;
    result.iterations = whole.iterations;
    result.wedge.flux = whole.flux;
    result.wedge.error.assign(whole.flux.size(), 0.0);
    result.triangle.error.assign(s.geometry.mesh.triangles.size(), 0.0);
    result.vertex.error.assign(s.geometry.mesh.vertices.size(), 0.0);
    ErrorSums sums;
    std::array<Values, 2> halves;
    const std::size_t halvings = s.viewed ? 0
                                 : options.errors
                                     ? std::clamp<std::size_t>(options.halvings, 1, std::size(kHalves))
                                 : options.unbiased ? 1
                                                    : 0;
    for (std::size_t k = 0; k < halvings; ++k) {
        const double tolerance = 10.0 * options.tolerance;
        Values one = solver.solve(kHalves[k], whole.flux, tolerance).flux,
               other = solver.solve(kAllGroups & ~kHalves[k], whole.flux, tolerance).flux;
        sums.add(s, difference(one, other));
        // The bias falls as 1 / rays: each half of the rays has twice the bias of the whole.
        for (std::size_t i = 0; i < whole.flux.size() && options.unbiased; ++i)
            result.wedge.flux[i] +=
                (whole.flux[i] - 0.5 * (one[i] + other[i])) / static_cast<double>(halvings);
        if (k == 0) halves = {std::move(one), std::move(other)};
    }
    for (double& flux : result.wedge.flux) flux = std::max(0.0, flux);
    if (s.viewed) halves = {whole.flux, whole.flux};
    // Half of the difference between two halves has the standard error of the whole: its square is a quarter.
    if (options.errors && !s.viewed) sums.put(0.25 / static_cast<double>(halvings), result);
    result.triangle.flux = over_triangles(s, result.wedge.flux);
    result.vertex.flux = over_vertices(s, result.wedge.flux);
    result.statistical_error = statistical_error(s.wedges, result.vertex);
    if (options.errors)
        result.discretisation_error =
            discretisation_error(s, species, solver, result.wedge.flux, halves[0], halves[1]);
    result.relative_error = std::hypot(result.statistical_error, result.discretisation_error);
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
