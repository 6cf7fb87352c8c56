#include "app/process/estimate/pilot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "app/process/arriving/coverages.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/arriving/radiosity_fluxes.hpp"
#include "app/process/arriving/trace.hpp"
#include "app/process/arriving/traced_mesh.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "levelset/meshes/extract.hpp"

namespace sidewall::app {
namespace {

double relative_error(const TracedSurface& surface) {
    double error = 0.0;
    for (const flux::FluxResult& flux : surface.arriving->trace->species)
        error = std::max(error, flux.largest_error());
    return error;
}

double seconds_of_reducing(const Timing& timing) {
    return timing.extract + timing.features + timing.simplify + timing.bvh;
}

// Number of rays of all species, and number of species.
std::pair<double, double> rays_of(const TracedSurface& surface) {
    double rays = 0.0;
    for (const flux::FluxResult& flux : surface.arriving->trace->species)
        rays += static_cast<double>(flux.emitted);
    return {rays, static_cast<double>(surface.arriving->trace->species.size())};
}

// The most rays that radiosity may gather, and the relative errors asked for by the recipe or by auto.
struct Asked {
    double most = 0.0;
    std::vector<double> errors;  // by species; 0: none
};

Asked asked_of(const FluxSection& flux, const std::vector<SpeciesMethod>& methods) {
    Asked asked{radiosity_memory(flux) / static_cast<double>(flux::exchange_bytes(1)), {}};
    for (const SpeciesMethod& method : methods)
        asked.errors.push_back(flux.relative_error.value_or(method.target));
    return asked;
}

// Adds a message if the allowed rays do not reach the error asked for.
void note_error(const PilotRequest& e, const std::string& species, bool solved, double error, double asked,
                Pilot& pilot) {
    constexpr double kScatter = 1.1;  // of the estimated error
    if (!(asked > 0.0) || !(error > kScatter * asked)) return;
    const FluxSection& flux = e.recipe.flux;
    pilot.short_of.push_back(fmt::format(
        "{}: the rays allowed ({}) reach a relative error of about {:.2g}, not the {:.2g} {}", species,
        solved ? fmt::format("flux.memory = {:g}, {} = {:g}", flux.memory,
                             flux.relative_error ? "flux.max_rays" : "flux.rays",
                             static_cast<double>(flux.most_rays()))
               : fmt::format("flux.max_rays = {:g}", static_cast<double>(flux.max_rays)),
        error, asked, flux.rays == 0 || flux.relative_error ? "asked for" : "of its paths"));
}

// Extrapolates a trace with radiosity from few rays. The number of rays needed, and with it the time of
// gathering and solving, grows as 1/error^2; so do the number and the time of Monte Carlo paths.
void count_solved(const PilotRequest& e, double seconds, double path_rays, double paths_needed,
                  Pilot& pilot) {
    const TraceReport& trace = *pilot.surface.arriving->trace;
    const Asked asked = asked_of(e.recipe.flux, pilot.methods);
    double gathered = 0.0, passes = 0.0, path_seconds = 0.0, worst = 0.0;
    bool noisy = false;  // a profile's exchange may be without noise (viewed)
    for (std::size_t k = 0; k < trace.species.size(); ++k) {
        const flux::FluxResult& result = trace.species[k];
        if (trace.methods[k].radiosity) {
            gathered = static_cast<double>(result.emitted);
            noisy = noisy || result.relative_error > result.discretisation_error;
            if (asked.errors[k] > 0.0) worst = std::max(worst, result.relative_error / asked.errors[k]);
        } else if (result.pass_place == 0) {
            passes += 1.0;
            path_seconds += result.seconds;
        }
    }
    const double most = noisy ? std::max(gathered, asked.most) : gathered;
    const double needed = worst > 0.0 ? std::clamp(e.cells * gathered * worst * worst, gathered, most) : most;
    for (std::size_t k = 0; k < trace.species.size(); ++k) {
        const bool solved = trace.methods[k].radiosity;
        const double error = trace.species[k].relative_error *
                             std::sqrt(e.cells * (solved ? gathered / needed : path_rays / paths_needed));
        pilot.error = std::max(pilot.error, error);
        note_error(e, trace.methods[k].species, solved, error, asked.errors[k], pilot);
    }
    pilot.rays = passes * paths_needed;
    if (noisy) {
        pilot.rays += needed / pilot.later;  // one gather serves all traces
        pilot.exchange_bytes = static_cast<double>(flux::exchange_bytes(static_cast<std::uint64_t>(needed)));
    } else {
        const std::size_t wedges = pilot.surface.arriving->wedges.count();
        pilot.exchange_bytes = static_cast<double>(flux::view_bytes(wedges / 2));
    }
    pilot.seconds = std::max(0.0, seconds / pilot.later - path_seconds) * needed / gathered +
                    path_seconds * paths_needed / path_rays;
}

// Few rays between surface points may leave some without a way out, so that the balance has no solution:
// tries again with more rays, up to \p most.
TracedSurface traced_if_enough(const PilotRequest& e, const Model& model, Recipe& probe,
                               const SurfaceField& carried, const TraceRequest& request, double most,
                               Timing& timing) {
    while (true) {
        try {
            return trace_surface(probe, model, e.stack, carried, request, timing);
        } catch (const NumericsError&) {
            const auto rays = static_cast<double>(probe.flux.rays);
            if (e.recipe.flux.method == "monte-carlo" || rays >= most) throw;
            probe.flux.rays = static_cast<std::int64_t>(std::min(most, 4.0 * rays));
            timing = {};
        }
    }
}

}  // namespace

Pilot trace_pilot(const PilotRequest& e, const Model& model) {
    Pilot pilot;
    TracedSurface& surface = pilot.surface;
    Timing first, second;
    Recipe probe = e.measured;
    const std::optional<double> target = e.noise ? e.noise : probe.flux.relative_error;
    const auto most = static_cast<double>(probe.flux.most_rays());
    probe.flux.max_rays = probe.flux.most_rays();
    const double few = std::min(most, 1e4);
    probe.flux.relative_error.reset();
    probe.flux.rays = static_cast<std::int64_t>(few);
    // In a profile radiosity has no noise: its fluxes lead to the same mesh as the run's.
    if (probe.flux.method == "auto")
        probe.flux.method = is_plane_profile(probe.domain) ? "radiosity" : "monte-carlo";
    if (probe.simplify.method == "auto") {
        const auto triangles = static_cast<double>(levelset::extract_surface(e.stack).triangles.size());
        const bool coarse = coarsens(e.recipe, model, static_cast<std::size_t>(e.cells * triangles), e.noise);
        probe.simplify.method = coarse ? "region-bounded" : "none";
    }
    surface = traced_if_enough(e, model, probe, {}, {.settle = true}, most, first);
    pilot.reducing = seconds_of_reducing(first);
    if (model.species.empty()) return pilot;
    const std::vector<double> sticking = sticking_left(model, surface, *surface.arriving);
    pilot.methods =
        choose_methods(e.measured, model, surface, *surface.arriving, sticking, {.noise = e.noise});
    pilot.at_start = surface.arriving->trace->traces;
    pilot.later = model.coverages.pulse > 0.0 ? pilot.at_start : 1;

    // A trace of few rays underestimates its error, so up to kUncertain times the estimated rays are allowed.
    constexpr double kUncertain = 4.0;
    const auto needed_for = [&](double rays) {
        const double error = target ? relative_error(surface) / *target : 0.0;
        return target ? std::clamp(e.cells * rays * error * error, few, most) : most;
    };
    const double one = first.trace / pilot.at_start;
    double rays =
        std::clamp(few * e.effort / (pilot.later * one), few, std::min(most, kUncertain * needed_for(few)));
    const bool any_solved = std::ranges::any_of(pilot.methods, &SpeciesMethod::radiosity);
    std::vector<SpeciesMethod> methods = pilot.methods;
    if (any_solved) {                            // no more rays than an error estimate needs
        constexpr double kRaysOfUnknown = 31.0;  // more are placed by importance, and leave some places few
        for (SpeciesMethod& method : methods) method.target = 0.0;
        rays = std::min(kRaysOfUnknown * static_cast<double>(surface.arriving->wedges.count()),
                        asked_of(e.recipe.flux, methods).most);
    }
    probe.flux.rays = static_cast<std::int64_t>(rays);
    const SurfaceField carried =
        field_to_carry(e.measured, model, surface, coverages_after(model, surface, 0.0));
    const TraceRequest again{.key = 1, .methods = std::move(methods)};
    surface = traced_if_enough(e, model, probe, carried, again, most, second);
    if (any_solved) rays = static_cast<double>(probe.flux.rays);
    pilot.reducing = seconds_of_reducing(second);

    if (any_solved) {
        count_solved(e, second.trace, rays, needed_for(rays), pilot);
        return pilot;
    }
    const double two = second.trace / pilot.later;
    const bool rises = rays > 1.5 * few && two > one;
    const double per_ray = rises ? (two - one) / (rays - few) : two / rays;
    const double fixed = std::max(0.0, two - per_ray * rays);
    double needed = needed_for(rays);
    pilot.rays = rays_of(surface).first * needed / rays;
    pilot.error = relative_error(surface) * std::sqrt(e.cells * rays / needed);
    if (target && relative_error(surface) <= *target && e.cells == 1.0) {  // trace as the run will
        probe.flux.relative_error = target;
        surface = trace_surface(probe, model, e.stack, carried, {.key = 1, .methods = pilot.methods}, first);
        const auto [all, times] = rays_of(surface);
        pilot.rays = all;
        needed = all / times;
        pilot.error = relative_error(surface);
    }
    for (std::size_t k = 0; k < model.species.size() && target; ++k)
        note_error(e, model.species[k].name, false, pilot.error, *target, pilot);
    pilot.seconds = e.cells * fixed + per_ray * needed;
    return pilot;
}

}  // namespace sidewall::app
