#include "app/process/estimate/estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/common/processes.hpp"
#include "app/common/timing.hpp"
#include "app/models/geometric_steps.hpp"
#include "app/process/arriving/coverages.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/arriving/traced_mesh.hpp"
#include "app/process/endpoint.hpp"
#include "app/process/estimate/blanket.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/process/estimate/pilot.hpp"
#include "app/process/noise.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/process/time_step.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/layers.hpp"
#include "app/results/cut_profile.hpp"
#include "app/results/metrology.hpp"
#include "flux/radiosity/exchange.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/volume.hpp"
#include "surface/files/vtp.hpp"

namespace sidewall::app {
namespace {

// The estimate while steps are being counted.
struct Estimation {
    const Recipe& recipe;
    Recipe measured;      // the recipe on the grid that is measured
    RunState state;       // with the wafer on that grid
    double cells = 1.0;   // cells of the recipe's grid per cell of that grid
    double effort = 0.0;  // seconds to trace each step
    double limit = 0.0;   // seconds for all steps
    double start = now();
    double lowest = 0.0;                         // z below which the steps so far cannot etch
    double measured_time = 0.0;                  // process time of the measured steps
    double left_out = 0.0;                       // process time of the steps beyond the limit
    double exchange_bytes = 0.0;                 // largest of all steps, for radiosity's rays
    double last_rays = 0.0, last_seconds = 0.0;  // of the trace and files that end the run
    Estimate total;
};

// The recipe on a grid of at most about kMemory bytes, at most four times coarser so as not to lose shapes.
Recipe on_coarser_grid(const Recipe& recipe, double memory) {
    constexpr double kMemory = 2e8, kCoarsest = 4.0;
    const double factor = std::min(kCoarsest, std::ceil(std::sqrt(memory / kMemory)));
    Recipe coarse = recipe;
    // A wafer from another run keeps that run's grid.
    if (factor <= 1.0 || !recipe.start.from.empty()) return coarse;
    coarse.domain.grid_spacing = factor * domain_of(recipe).spacing;
    coarse.flux.averaging *= factor;
    SimplifySection& simplify = coarse.simplify;
    for (std::optional<double>* length : {&simplify.l0, &simplify.step, &simplify.l_max, &simplify.max_error})
        if (*length) **length *= factor;
    try {
        domain_of(coarse);
    } catch (const RecipeError&) {  // this spacing does not divide both extents
        return recipe;
    }
    return coarse;
}

// Number of time steps at constant speed, in equal parts between saved surfaces.
double time_steps(const Recipe& recipe, double duration, double speed) {
    const double pieces = recipe.output.every ? std::ceil(duration / *recipe.output.every) : 1.0;
    return pieces *
           equal_time_steps(duration / pieces, speed, domain_of(recipe).spacing, recipe.advection.cfl);
}

// Seconds to write the surface and the interfaces below it to files.
double seconds_to_save(const Model& model, const levelset::MaterialStack& stack,
                       const TracedSurface& surface) {
    constexpr std::ptrdiff_t kEnough = 8;  // layers that suffice to time one
    const auto layers = std::min(std::ssize(stack.layers), kEnough);
    const levelset::MaterialStack upper = levelset::upper_layers(stack, layers);
    const double start = now();
    levelset::StackMeshes meshes = levelset::extract_materials(upper, surface.raw);
    const double extracted = now();
    surface::encode_vtp(result_mesh(model, upper, surface, std::move(meshes.surface)));
    const double files = static_cast<double>(stack.layers.size() + (surface.simplified ? 1 : 0));
    return files / static_cast<double>(layers) * (extracted - start) + files * (now() - extracted);
}

// Seconds for the end of a step, without saving: the surface's pieces, figures and volumes.
double seconds_to_close(const Recipe& recipe, const levelset::MaterialStack& stack) {
    const double start = now();
    const TriangleMesh surface = levelset::extract_surface(stack);
    levelset::surface_pieces(surface, stack);
    measure(recipe, stack, surface);
    layer_volumes(stack);
    return now() - start;
}

// The largest |V| of all materials on the wafer, but at least \p at_first. Buried ones count, as an etch will
// reach them. Films of earlier steps count everywhere, though no time step has grown them here; the step's
// own film counts where it grows.
double fastest_speed(const Model& model, const levelset::MaterialStack& stack, const levelset::Motion& motion,
                     double at_first) {
    double fastest = 0.0;
    for (std::size_t n = 0; n < motion.extension.samples.size(); ++n) {
        const std::size_t bare = exposed(stack, motion.extension, n);
        for (std::size_t k = 0; k < stack.layers.size(); ++k) {
            const double v = motion.law.speed(n, k, Vec3::UnitZ());
            const bool own_film = k > bare && stack.layers[k].material == model.deposit;
            if (std::isfinite(v) && (v > 0.0 || !own_film)) fastest = std::max(fastest, std::abs(v));
        }
    }
    if (stack.coarser) fastest = fastest_speed(model, *stack.coarser, *motion.coarser, fastest);
    if (model.depends_on_normal && fastest > 0.0)
        fastest = std::max(fastest, model.hints.max_speed.value_or(0.0));
    return std::max(fastest, at_first);
}

// The speed towards the step's stop condition: that of the lowest points for a depth, else \p fastest.
double speed_to_stop(const Step& step, const levelset::MaterialStack& stack, const levelset::Motion& motion,
                     double fastest) {
    if (!step.stop_depth) return fastest;
    if (stack.coarser)
        return speed_to_stop(step, *stack.coarser, *motion.coarser, fastest);  // it covers the whole domain
    const auto height = [](const levelset::SurfaceSample& s) {
        return s.node.z() + static_cast<double>(s.foot.z());
    };
    double lowest = kInfinity, speed = 0.0;
    for (const levelset::SurfaceSample& s : motion.extension.samples) lowest = std::min(lowest, height(s));
    for (std::size_t n = 0; n < motion.extension.samples.size(); ++n)
        if (height(motion.extension.samples[n]) < lowest + 1.0)
            speed = std::max(
                speed, std::abs(motion.law.speed(n, exposed(stack, motion.extension, n), Vec3::UnitZ())));
    return speed;
}

// Measures the narrowest opening of the initial wafer, between 1/4 and 3/4 of its height.
void measure_openings(Estimation& e) {
    const TriangleMesh surface = levelset::extract_surface(e.state.stack);
    if (surface.vertices.empty()) return;
    const Box3 box = bounding_box(surface);
    const double height = box.max.z() - box.min.z();
    if (height < e.state.stack.domain.spacing) return;
    const Profile profile =
        profile_of(surface, surface::parse_plane(e.recipe.metrology.cut), e.state.stack.domain);
    double narrowest = kInfinity;
    constexpr int kHeights = 16;
    for (int k = kHeights / 4; k <= 3 * kHeights / 4; ++k)
        for (const auto& [from, to] : openings(profile, box.min.z() + height * k / kHeights))
            narrowest = std::min(narrowest, to - from);
    if (!std::isfinite(narrowest)) return;
    e.total.narrowest = narrowest;
    e.total.aspect_ratio = height / narrowest;
}

// Makes the first time step of a step and adds the cost of all its time steps and \p times repetitions.
void count_step(Estimation& e, const Step& step, double times) {
    const Model& model = *step.built;
    if (model.deposit) levelset::begin_film(e.state.stack, *model.deposit);
    const Pilot pilot = trace_pilot(
        {e.recipe, e.measured, e.state.stack, e.cells, e.effort, noise_of_time_step(e.recipe, step, times)},
        model);
    e.total.flux_error = std::max(e.total.flux_error, pilot.error);
    e.exchange_bytes = std::max(e.exchange_bytes, std::min(pilot.exchange_bytes, 1e9 * e.recipe.flux.memory));
    if (e.recipe.flux.method != "monte-carlo" && !pilot.methods.empty()) {
        const std::string methods = describe(pilot.methods);
        std::vector<std::string>& known = e.total.methods;
        if (std::ranges::find(known, methods) == known.end()) known.push_back(methods);
    }
    for (const std::string& note : pilot.short_of)
        if (std::ranges::find(e.total.short_of, note) == e.total.short_of.end())
            e.total.short_of.push_back(note);
    e.last_rays = pilot.rays;
    e.last_seconds = e.cells * pilot.reducing + pilot.seconds;

    note_masks(e.measured, step, model, pilot.surface.raw, e.state);
    double start = now();
    const double to_stop = distance_to_stop(e.measured, step, e.state, pilot.surface.raw).left;
    if (to_stop == 0.0 && step.over_etch_time == 0.0) return;
    Timing timing;
    std::vector<levelset::Motion> motions;
    motions.push_back(surface_motion(model, e.state.stack, pilot.surface, timing));
    const levelset::Motion& motion = motions.front();
    const TimeStep next = choose_time_step(e.recipe, step, model, e.state, motion,
                                           to_stop > 0.0 ? to_stop : StopDistance().left);
    measure(e.measured, e.state.stack, pilot.surface.raw);
    double moving = now() - start;
    const double closing = seconds_to_close(e.measured, e.state.stack);
    const double fastest = fastest_speed(model, e.state.stack, motion, next.speed);
    const double towards = speed_to_stop(step, e.state.stack, motion, fastest);
    const auto lasts = [&](double speed) {
        if (!(speed > 0.0) || !std::isfinite(to_stop)) return step.duration;
        return std::min(step.duration, to_stop / speed * (1.0 + step.over_etch) + step.over_etch_time);
    };
    const double duration = lasts(towards);
    const double saving = seconds_to_save(model, e.state.stack, pilot.surface);
    e.last_seconds += e.cells * saving;
    start = now();
    advect(e.measured, motions, next, e.state.stack, timing);
    if (pilot.surface.arriving && pilot.surface.arriving->trace)
        field_to_carry(e.measured, model, pilot.surface,
                       coverages_after(model, pilot.surface, next.dt));  // only to time it
    moving += now() - start;

    const bool all_stages = e.recipe.flux.stages == "all" && !model.species.empty();
    const double stages =
        all_stages ? static_cast<double>(levelset::stage_count(e.recipe.advection.time_integration)) : 1.0;
    const auto count = [&](double lasting, double speed) {
        return std::max(time_steps(e.recipe, lasting, speed), lasting / step.duration * model.min_time_steps);
    };
    const auto traces_in = [&](double steps) {
        return steps * stages * pilot.later + pilot.at_start - pilot.later;
    };
    constexpr double kLater =
        1.2;  // cost of a time step over that of the first: features deepen (median of configs/quick)
    const auto seconds_of = [&](double lasting, double steps) {
        const double saves = e.recipe.output.every ? lasting / *e.recipe.output.every : 1.0;
        return kLater * times *
               (traces_in(steps) * pilot.seconds +
                e.cells * (steps * (moving + stages * pilot.reducing) + saves * saving + closing));
    };
    const double steps = count(duration, fastest);
    e.total.time_steps += times * steps;
    e.total.rays += times * traces_in(steps) * pilot.rays;
    e.total.seconds += seconds_of(duration, steps);
    // Upper bound: blanket rates of all materials that the step meets, with settled coverages.
    const double anywhere = std::max(fastest, fastest_blanket(e.recipe, step));
    const double soonest = std::min(duration, lasts(anywhere));
    e.total.least_seconds += seconds_of(soonest, count(soonest, next.speed));
    e.total.most_seconds += seconds_of(step.duration, count(step.duration, anywhere));
    e.lowest -= 2.0 * times * duration * fastest;
}

void count_reshaping(Estimation& e, const Step& step, double times) {
    // Polishing below this wafer is no error if the steps before, of which only one time step was made, may
    // etch as deep; nor on a coarser grid, which loses openings.
    if (step.model == "planarize") {
        const double height = geometric_step(step.parameters)->height;
        if (height < lowest_of_substrate(e.state.stack) && (height >= e.lowest || e.cells != 1.0)) return;
    }
    const double start = now();
    reshape(e.measured, step, e.state.stack);
    double once = now() - start + seconds_to_close(e.measured, e.state.stack);
    Timing timing;
    if (!e.recipe.output.every)
        once += seconds_to_save(still_model(), e.state.stack, extract(e.state.stack, 0.0, timing));
    const double seconds = times * e.cells * once;
    for (double* total : {&e.total.seconds, &e.total.least_seconds, &e.total.most_seconds}) *total += seconds;
}

// Counts the steps as written. \p times: how often the enclosing loops repeat them.
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
            e.measured_time += repeated * step.duration;
            count_step(e, step, repeated);
        }
    }
}

// Rough number of seconds to build the recipe's wafer.
double seconds_to_build(const Recipe& recipe) {
    constexpr double kSeconds = 4e-6;  // for a cell and layer, on one thread
    const levelset::Domain domain = domain_of(recipe);
    const auto layers = static_cast<double>(layer_count(recipe));
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
    constexpr double kProgram = 5e7;  // bytes of code, libraries and threads, for any recipe
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
    measure_openings(e);
    e.lowest = lowest_of_substrate(e.state.stack);
    e.start = now();
    count(e, recipe.steps, "", 1.0);
    if (e.measured_time > 0.0) {
        const double whole = 1.0 + e.left_out / e.measured_time;
        for (double* figure : {&e.total.time_steps, &e.total.rays, &e.total.seconds, &e.total.least_seconds,
                               &e.total.most_seconds})
            *figure *= whole;
    }
    e.total.rays += e.last_rays;
    constexpr double kScatter = 2.0;        // nine in ten of the recipes in configs take within this factor
    constexpr double kProgramStart = 0.03;  // seconds
    const double around = kProgramStart + e.total.building + e.last_seconds;
    e.total.seconds += around;
    e.total.least_seconds = (e.total.least_seconds + around) / kScatter;
    e.total.most_seconds = kScatter * (e.total.most_seconds + around);
    e.total.memory += e.exchange_bytes;
    return e.total;
}

}  // namespace sidewall::app
