#include "app/process/estimate/estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "app/common/threads.hpp"
#include "app/common/timing.hpp"
#include "app/models/geometric_steps.hpp"
#include "app/process/arriving/coverages.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/arriving/radiosity_fluxes.hpp"
#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/estimate/fastest_speed.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/process/reshape.hpp"
#include "app/process/state.hpp"
#include "app/process/stop.hpp"
#include "app/process/time_step.hpp"
#include "app/recipe/layers.hpp"
#include "app/results/metrology.hpp"
#include "flux/radiosity/radiosity.hpp"
#include "levelset/layers/levels.hpp"

namespace sidewall::app {
namespace {

// What is known so far.
struct Estimation {
    const Recipe& recipe;
    Recipe measured;      // on the grid that is looked at
    RunState state;       // of the wafer on it
    double cells = 1.0;   // of the recipe's grid for one of this
    double effort = 0.0;  // seconds of tracing a step
    double limit = 0.0;   // seconds for all steps
    double start = now();
    double lowest = 0.0;                         // below this the steps so far cannot etch
    double looked_at = 0.0;                      // process time of the steps that were,
    double left_out = 0.0;                       // and of those that the limit left out
    double link_bytes = 0.0;                     // of the step whose radiosity takes the most
    double last_rays = 0.0, last_seconds = 0.0;  // of a trace and the files with which the run ends
    Estimate total;
};

// The fluxes of a step's first time step.
struct Tracing {
    TracedSurface surface;
    double reducing = 0.0;               // seconds from the grid to the mesh that is traced
    double seconds = 0.0;                // of a trace with all rays
    double rays = 0.0;                   // all, of all species
    int at_start = 0, later = 0;         // traces of the step's first time step and of the others
    double error = 0.0;                  // relative, of the worst species
    double link_bytes = 0.0;             // that the rays of radiosity take
    std::vector<SpeciesMethod> methods;  // by species
    std::vector<std::string> short_of;   // of the errors asked for
};

// The recipe on a grid that needs at most about this much memory, but four times coarser at most: more would
// lose its shapes.
Recipe on_coarser_grid(const Recipe& recipe, double memory) {
    constexpr double kMemory = 2e8, kCoarsest = 4.0;
    const double factor = std::min(kCoarsest, std::ceil(std::sqrt(memory / kMemory)));
    Recipe coarse = recipe;
    // The wafer of an earlier run comes on its own grid.
    if (factor <= 1.0 || !recipe.start.from.empty()) return coarse;
    coarse.domain.grid_spacing = factor * domain_of(recipe).spacing;
    coarse.flux.averaging *= factor;
    SimplifySection& simplify = coarse.simplify;
    for (std::optional<double>* length : {&simplify.l0, &simplify.step, &simplify.l_max, &simplify.max_error})
        if (*length) **length *= factor;
    try {
        domain_of(coarse);
    } catch (const RecipeError&) {  // no such spacing divides both extents
        return recipe;
    }
    return coarse;
}

double relative_error(const TracedSurface& surface) {
    double error = 0.0;
    for (const flux::FluxResult& flux : surface.arriving->trace->species)
        error = std::max(error, flux.relative_error);
    return error;
}

double seconds_of_reducing(const Timing& timing) {
    return timing.extract + timing.features + timing.simplify + timing.bvh;
}

// Rays of all species, and of how many.
std::pair<double, double> rays_of(const TracedSurface& surface) {
    double rays = 0.0;
    for (const flux::FluxResult& flux : surface.arriving->trace->species)
        rays += static_cast<double>(flux.emitted);
    return {rays, static_cast<double>(surface.arriving->trace->species.size())};
}

// The most rays of radiosity, and the errors that they are for: what a recipe asks, or auto.
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

// Says so if the rays allowed do not reach the error asked for.
void note_error(const Estimation& e, const std::string& species, bool solved, double error, double asked,
                Tracing& tracing) {
    constexpr double kScatter = 1.1;  // of an estimate's error
    if (!(asked > 0.0) || !(error > kScatter * asked)) return;
    const FluxSection& flux = e.recipe.flux;
    tracing.short_of.push_back(fmt::format(
        "{}: the rays allowed ({}) reach a relative error of about {:.2g}, not the {:.2g} {}", species,
        solved ? fmt::format("flux.memory = {:g}, {} = {:g}", flux.memory,
                             flux.relative_error ? "flux.max_rays" : "flux.rays",
                             static_cast<double>(flux.relative_error ? flux.max_rays : flux.rays))
               : fmt::format("flux.max_rays = {:g}", static_cast<double>(flux.max_rays)),
        error, asked, flux.relative_error ? "asked for" : "of its paths"));
}

// What a trace with radiosity comes to from one of few rays: of paths, their number and time go with the
// square of the error; of radiosity, the number of its rays, and with it the time of gathering and solving.
void count_solved(const Estimation& e, double seconds, double path_rays, double paths_needed,
                  Tracing& tracing) {
    const TraceReport& trace = *tracing.surface.arriving->trace;
    const Asked asked = asked_of(e.recipe.flux, tracing.methods);
    double gathered = 0.0, passes = 0.0, path_seconds = 0.0, worst = 0.0;
    for (std::size_t k = 0; k < trace.species.size(); ++k) {
        const flux::FluxResult& result = trace.species[k];
        if (trace.methods[k].radiosity) {
            gathered = static_cast<double>(result.emitted);
            if (asked.errors[k] > 0.0) worst = std::max(worst, result.relative_error / asked.errors[k]);
        } else if (result.pass_place == 0) {
            passes += 1.0;
            path_seconds += result.seconds;
        }
    }
    const double most = std::max(gathered, asked.most);
    const double needed = worst > 0.0 ? std::clamp(e.cells * gathered * worst * worst, gathered, most) : most;
    for (std::size_t k = 0; k < trace.species.size(); ++k) {
        const bool solved = trace.methods[k].radiosity;
        const double error = trace.species[k].relative_error *
                             std::sqrt(e.cells * (solved ? gathered / needed : path_rays / paths_needed));
        tracing.error = std::max(tracing.error, error);
        note_error(e, trace.methods[k].species, solved, error, asked.errors[k], tracing);
    }
    tracing.rays = needed / tracing.later + passes * paths_needed;  // gathered once for all traces
    tracing.link_bytes = static_cast<double>(flux::exchange_bytes(static_cast<std::uint64_t>(needed)));
    tracing.seconds = std::max(0.0, seconds / tracing.later - path_seconds) * needed / gathered +
                      path_seconds * paths_needed / path_rays;
}

// Too few rays between points of the surface may leave some of it without a way out: then more, up to \p
// most.
TracedSurface traced_if_enough(const Estimation& e, const Model& model, Recipe& probe,
                               const SurfaceField& carried, const TraceRequest& request, double most,
                               Timing& timing) {
    while (true) {
        try {
            return trace_surface(probe, model, e.state.stack, carried, request, timing);
        } catch (const NumericsError&) {
            const auto rays = static_cast<double>(probe.flux.rays);
            if (e.recipe.flux.method == "monte-carlo" || rays >= most) throw;
            probe.flux.rays = static_cast<std::int64_t>(std::min(most, 4.0 * rays));
            timing = {};
        }
    }
}

// Traces a pilot, which also lets the coverages settle, and then as many rays as the effort allows.
Tracing trace(const Estimation& e, const Model& model) {
    Tracing tracing;
    TracedSurface& surface = tracing.surface;
    Timing first, second;
    Recipe probe = e.measured;
    const std::optional<double> target = probe.flux.relative_error;
    const auto most = static_cast<double>(target ? probe.flux.max_rays : probe.flux.rays);
    const double pilot = std::min(most, 1e4);
    probe.flux.relative_error.reset();
    probe.flux.rays = static_cast<std::int64_t>(pilot);
    if (probe.flux.method == "auto") probe.flux.method = "monte-carlo";
    surface = traced_if_enough(e, model, probe, {}, {0, true}, most, first);
    tracing.reducing = seconds_of_reducing(first);
    if (model.species.empty()) return tracing;
    const std::vector<double> sticking = sticking_left(model, surface, *surface.arriving);
    tracing.methods = choose_methods(e.measured, model, surface, *surface.arriving, sticking, {});
    tracing.at_start = surface.arriving->trace->traces;
    tracing.later = model.coverages.pulse > 0.0 ? tracing.at_start : 1;

    // A trace of few rays underestimates its error.
    constexpr double kUncertain = 4.0;
    const auto needed_for = [&](double rays) {
        const double error = target ? relative_error(surface) / *target : 0.0;
        return target ? std::clamp(e.cells * rays * error * error, pilot, most) : most;
    };
    const double one = first.trace / tracing.at_start;
    double rays = std::clamp(pilot * e.effort / (tracing.later * one), pilot,
                             std::min(most, kUncertain * needed_for(pilot)));
    const bool any_solved = std::ranges::any_of(tracing.methods, &SpeciesMethod::radiosity);
    std::vector<SpeciesMethod> methods = tracing.methods;
    if (any_solved) {  // as few as tell its error, whatever it is
        constexpr double kRaysOfUnknown =
            31.0;  // more would start where they matter, and leave some places few
        for (SpeciesMethod& method : methods) method.target = 0.0;
        rays = std::min(kRaysOfUnknown * static_cast<double>(surface.arriving->wedges.count()),
                        asked_of(e.recipe.flux, methods).most);
    }
    probe.flux.rays = static_cast<std::int64_t>(rays);
    const SurfaceField carried = field_to_carry(e.measured, model, surface, 0.0);
    const TraceRequest again{.key = 1, .methods = std::move(methods)};
    surface = traced_if_enough(e, model, probe, carried, again, most, second);
    if (any_solved) rays = static_cast<double>(probe.flux.rays);
    tracing.reducing = seconds_of_reducing(second);

    if (any_solved) {
        count_solved(e, second.trace, rays, needed_for(rays), tracing);
        return tracing;
    }
    const double two = second.trace / tracing.later;
    const bool tells = rays > 1.5 * pilot && two > one;
    const double per_ray = tells ? (two - one) / (rays - pilot) : two / rays;
    const double fixed = std::max(0.0, two - per_ray * rays);
    double needed = needed_for(rays);
    tracing.rays = rays_of(surface).first * needed / rays;
    tracing.error = relative_error(surface) * std::sqrt(e.cells * rays / needed);
    if (target && relative_error(surface) <= *target && e.cells == 1.0) {  // the run will stop as early
        probe.flux.relative_error = target;
        surface = trace_surface(probe, model, e.state.stack, carried, {.key = 1, .methods = tracing.methods},
                                first);
        const auto [all, times] = rays_of(surface);
        tracing.rays = all;
        needed = all / times;
        tracing.error = relative_error(surface);
    }
    for (std::size_t k = 0; k < model.species.size() && target; ++k)
        note_error(e, model.species[k].name, false, tracing.error, *target, tracing);
    tracing.seconds = e.cells * fixed + per_ray * needed;
    return tracing;
}

// As choose_time_step divides a step of constant speed.
double time_steps(const Recipe& recipe, double duration, double speed) {
    const double pieces = recipe.output.every ? std::ceil(duration / *recipe.output.every) : 1.0;
    const double distance = duration / pieces * speed / (recipe.advection.cfl * domain_of(recipe).spacing);
    return pieces * std::max(1.0, std::ceil(distance * (1.0 - 1e-9)));
}

// Seconds to put the surface and what lies below it into files.
double seconds_to_save(const Model& model, const levelset::MaterialStack& stack,
                       const TracedSurface& surface) {
    constexpr std::ptrdiff_t kEnough = 8;  // layers tell what one takes
    const auto layers = std::min(std::ssize(stack.layers), kEnough);
    const levelset::MaterialStack upper = levelset::upper_layers(stack, layers);
    const double start = now();
    levelset::StackMeshes meshes = levelset::extract_materials(upper, surface.raw);
    const double extracted = now();
    surface::encode_vtp(result_mesh(model, upper, surface, std::move(meshes.surface)));
    const double files = static_cast<double>(stack.layers.size() + (surface.simplified ? 1 : 0));
    return files / static_cast<double>(layers) * (extracted - start) + files * (now() - extracted);
}

// Makes the first time step of a step that is repeated \p times, and counts what all of them come to.
void count_step(Estimation& e, const Step& step, double times) {
    const Model& model = *step.built;
    if (model.deposit) levelset::begin_film(e.state.stack, *model.deposit);
    const Tracing tracing = trace(e, model);
    e.total.flux_error = std::max(e.total.flux_error, tracing.error);
    e.link_bytes = std::max(e.link_bytes, std::min(tracing.link_bytes, 1e9 * e.recipe.flux.memory));
    if (e.recipe.flux.method != "monte-carlo" && !tracing.methods.empty()) {
        const std::string methods = describe(tracing.methods);
        std::vector<std::string>& known = e.total.methods;
        if (std::ranges::find(known, methods) == known.end()) known.push_back(methods);
    }
    for (const std::string& note : tracing.short_of)
        if (std::ranges::find(e.total.short_of, note) == e.total.short_of.end())
            e.total.short_of.push_back(note);
    e.last_rays = tracing.rays;
    e.last_seconds = e.cells * tracing.reducing + tracing.seconds;

    double start = now();
    const double to_stop = distance_to_stop(e.measured, step, e.state.stack, tracing.surface.raw).left;
    if (to_stop == 0.0) return;
    Timing timing;
    const levelset::Motion motion = surface_motion(model, e.state.stack, tracing.surface, timing);
    const TimeStep next = choose_time_step(e.recipe, step, model, e.state, motion, to_stop);
    measure(e.measured, e.state.stack, tracing.surface.raw);
    double moving = now() - start;
    const double fastest = fastest_speed(model, e.state.stack, motion, next.speed);
    const double towards = speed_to_stop(step, e.state.stack, motion, fastest);
    const double duration = towards > 0.0 ? std::min(step.duration, to_stop / towards) : step.duration;
    const double saving = seconds_to_save(model, e.state.stack, tracing.surface);
    e.last_seconds += e.cells * saving;
    start = now();
    levelset::advect(e.state.stack, motion, next.dt, scheme_for(model, e.measured.advection));
    moving += now() - start;

    const double steps =
        std::max(time_steps(e.recipe, duration, fastest), duration / step.duration * model.least_time_steps);
    const double saves = e.recipe.output.every ? duration / *e.recipe.output.every : 1.0;
    const bool all_stages = e.recipe.flux.stages == "all" && !model.species.empty();
    const double stages =
        all_stages ? static_cast<double>(levelset::stage_count(e.recipe.advection.time_integration)) : 1.0;
    const double traces = steps * stages * tracing.later + tracing.at_start - tracing.later;
    e.total.time_steps += times * steps;
    e.total.rays += times * traces * tracing.rays;
    e.total.seconds += times * (traces * tracing.seconds +
                                e.cells * (steps * (moving + stages * tracing.reducing) + saves * saving));
    e.lowest -= 2.0 * times * duration * fastest;
}

void count_reshaping(Estimation& e, const Step& step, double times) {
    // The wafer is as before the steps that take time: what they etch lies deeper. A coarser grid loses
    // openings.
    if (step.model == "planarize") {
        const double height = geometric_step(step.parameters)->height;
        if (height < lowest_point(e.state.stack) && (height >= e.lowest || e.cells != 1.0)) return;
    }
    const double start = now();
    reshape(e.measured, step, e.state.stack);
    e.total.seconds += times * e.cells * (now() - start);
}

// The steps as written, each \p times as often as loops repeat it.
void count(Estimation& e, const std::vector<Step>& steps, const std::string& number, double times) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        Step step = steps[i];
        const std::string label =
            number.empty() ? fmt::format("{}", i + 1) : fmt::format("{}.{}", number, i + 1);
        const double repeated = times * static_cast<double>(step.repeat);
        if (!step.steps.empty()) {
            count(e, step.steps, label, repeated);
            continue;
        }
        step.name = fmt::format("{} {}", label, step.name.empty() ? step.model : step.name);
        if (now() - e.start > e.limit) {
            e.left_out += repeated * step.duration;
        } else if (!step.built) {
            count_reshaping(e, step, repeated);
        } else {
            e.looked_at += repeated * step.duration;
            count_step(e, step, repeated);
        }
    }
}

// Seconds to build the recipe's wafer, roughly.
double seconds_to_build(const Recipe& recipe) {
    constexpr double kSeconds = 4e-6;  // a cell of a layer, of one thread
    const levelset::Domain domain = domain_of(recipe);
    const auto layers = static_cast<double>(expanded_layers(recipe).size());
    return kSeconds * domain.cells[0] * domain.cells[1] * layers / thread_count();
}

double written(const std::vector<Step>& steps) {
    double count = 0.0;
    for (const Step& step : steps) count += step.steps.empty() ? 1.0 : written(step.steps);
    return count;
}

}  // namespace

Estimate estimate_run(const Recipe& recipe, double effort, double most_building) {
    const double memory = estimated_memory(recipe, domain_of(recipe));
    constexpr double kProgram = 5e7;  // code, libraries and threads, whatever the recipe
    Estimation e{recipe, on_coarser_grid(recipe, memory), {}};
    e.total.memory = kProgram + memory;
    e.total.building = seconds_to_build(recipe);
    e.total.known = seconds_to_build(e.measured) <= most_building;
    if (!e.total.known) return e.total;
    e.effort = effort / written(recipe.steps);
    e.limit = 3.0 * effort;
    e.state = initial_state(e.measured);
    e.cells = std::pow(e.state.stack.domain.spacing / domain_of(recipe).spacing, 2);
    e.total.building = e.cells * (now() - e.start);
    e.total.seconds = 2.0 * e.total.building;  // the summary compares with it
    e.lowest = lowest_point(e.state.stack);
    e.start = now();
    count(e, recipe.steps, "", 1.0);
    if (e.looked_at > 0.0) {
        const double whole = 1.0 + e.left_out / e.looked_at;
        for (double* figure : {&e.total.time_steps, &e.total.rays, &e.total.seconds}) *figure *= whole;
    }
    e.total.rays += e.last_rays;
    e.total.seconds += e.last_seconds;
    e.total.memory += e.link_bytes;
    return e.total;
}

}  // namespace sidewall::app
