#include "flux/radiosity.hpp"

#include <chrono>
#include <cmath>
#include <limits>

#include "flux/solver.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

using Values = std::vector<double>;

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
    Solver::Answer whole = solver.solve(all, species.guess, options.tolerance);
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
    }
    if (options.unbiased) {
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
