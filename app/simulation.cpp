#include "app/simulation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "app/flux_reuse.hpp"
#include "app/memory.hpp"
#include "app/metrology.hpp"
#include "app/result.hpp"
#include "app/run_state.hpp"
#include "app/run_writer.hpp"
#include "app/stop.hpp"
#include "app/surface_flux.hpp"
#include "levelset/extract.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Process time at which the time step must end: the end of the recipe's step or the next surface to save.
double next_stop(const RunState& state, const Recipe& recipe, double step_start, double duration) {
    const double end = step_start + duration;
    return recipe.output.every ? std::min(end, static_cast<double>(state.saved) * *recipe.output.every) : end;
}

// A stop condition that makes a step do nothing, or that nothing will ever meet.
void note_stop(const Step& step, std::size_t number, double to_stop) {
    const std::string& name = step.name.empty() ? step.model : step.name;
    if (to_stop == 0.0)
        fmt::print(stderr, "step {} ({}): its stop condition holds before it begins: it does nothing\n",
                   number + 1, name);
    else if (std::isinf(to_stop) && !step.stop_material.empty())
        fmt::print(stderr, "step {} ({}): there is no {} on the wafer for stop_material to meet\n",
                   number + 1, name, step.stop_material);
}

// Equal time steps up to the next stop, each moving the front at most cfl dx.
double time_step(double left, double speed, double spacing, double cfl) {
    if (speed <= 0.0) return left;
    // A hair's breadth over a whole number of steps must not cost one more.
    const double steps = std::ceil(left * speed / (cfl * spacing) * (1.0 - 1e-9));
    return left / std::max(1.0, steps);
}

// The longest time step towards a stop condition: it may overshoot by a twentieth of a grid spacing, but not
// creep.
double approach(double distance, double speed, double spacing, double cfl) {
    return speed > 0.0 ? std::max(distance, 0.1 * cfl * spacing) / speed
                       : std::numeric_limits<double>::infinity();
}

// Upwinding needs one speed a point; a speed that turns with the normal needs Lax-Friedrichs.
levelset::AdvectionOptions scheme_for(const Model& model, levelset::AdvectionOptions options) {
    if (model.depends_on_normal) options.scheme = levelset::Scheme::lax_friedrichs;
    return options;
}

// What bounds the time step. A sharp V(n) moves kinks faster than any point of a plane.
double fastest(const Model& model, double speed) {
    return model.depends_on_normal && speed > 0.0 ? std::max(speed, model.max_speed.value_or(0.0)) : speed;
}

// For how long the fluxes at hand will do. Those a step begins with tell nothing yet of how fast they change.
FluxReuse next_reuse(const Recipe& recipe, const Model& model, const RunState& state, bool begins,
                     bool traced, const SurfaceFlux& surface) {
    if (!traced) return {state.reuse.left - 1, state.reuse.since + 1};
    if (begins || model.species.empty() || recipe.flux.reuse == 0.0) return {0, 1};
    const double change = flux_change(model, state.coverage, surface);
    const std::uint32_t steps = steps_within(recipe.flux.reuse, change, state.reuse.since);
    return {steps > 0 ? steps - 1 : 0, 1};
}

// Adds the motions of the later stages to that of the first.
template <class Trace>
void add_stages(const Model& model, RunState& state, double dt, const levelset::AdvectionOptions& scheme,
                std::vector<levelset::Motion>& motions, Trace&& trace) {
    while (motions.size() < levelset::stage_count(scheme.time_integration)) {
        levelset::MaterialStack reached = levelset::copy(state.stack);
        levelset::advect_to_stage(reached, motions, dt, scheme);
        motions.push_back(surface_motion(model, reached, trace(reached), state.timing));
    }
}

}  // namespace

RunResult run_recipe(const Recipe& recipe, const RunOptions& options) {
    const std::vector<Step> steps = expanded_steps(recipe);
    const levelset::Domain domain = domain_of(recipe);
    require_memory(recipe, domain);
    RunState state = options.resume ? resume_state(options.output, recipe) : initial_state(recipe);
    if (options.resume && std::filesystem::exists(options.output / "summary.json"))
        return {levelset::extract_surface(state.stack.top(), domain), state.timing,
                read_summary(options.output)};
    RunWriter writer(options, recipe, state);
    const tbb::tick_count start = tbb::tick_count::now();
    const double earlier = state.timing.total;
    const auto count_total = [&] {
        state.timing.total = earlier + (tbb::tick_count::now() - start).seconds();
    };

    double total = 0.0;
    for (const Step& step : steps) total += step.duration;
    ProgressBar progress(options.title, total, recipe.domain.time_unit, !options.quiet);
    Model model;  // of the last step that takes time
    model.speed = [](const SurfacePoint&) { return 0.0; };
    const auto stop = [&] {
        count_total();
        writer.checkpoint(state);
        throw Interrupted(
            fmt::format("stopped at {:.6g} of {:.6g} {}; {}", state.time, total, recipe.domain.time_unit,
                        options.resume_command.empty() ? "what is finished is in " + options.output.string()
                                                       : "go on with: " + options.resume_command));
    };
    const auto trace_stack = [&](const levelset::MaterialStack& stack, const CoverageField& carried,
                                 bool settle, std::uint32_t key) {
        try {
            return trace_surface(recipe, model, stack, carried, settle, key, state.timing, [&](double part) {
                progress.update(state.time, fmt::format("tracing {:.0f} %", 100 * part));
            });
        } catch (const Interrupted&) {
            stop();
            throw;
        }
    };
    const auto trace = [&](bool settle) {
        return trace_stack(state.stack, state.coverage, settle, state.time_step);
    };
    // Within the time step; with random numbers of its own.
    const auto trace_stage = [&](const levelset::MaterialStack& stack, const CoverageField& carried,
                                 std::size_t stage) {
        constexpr int kStageBit = 30;
        return trace_stack(stack, carried, false,
                           state.time_step | static_cast<std::uint32_t>(stage) << kStageBit);
    };
    for (; state.step < steps.size(); state.enter(state.step + 1)) {
        const Step& step = steps[state.step];
        if (const ModelEntry* entry = find_model(step.model); entry->apply != nullptr) {
            entry->apply(step.values, recipe.materials, state.stack);
            continue;
        }
        model = make_model(step, recipe.materials, recipe.domain);
        if (model.deposit) levelset::begin_film(state.stack, *model.deposit);
        while (!state.reached(state.step_start + step.duration)) {
            const bool begins = state.time == state.step_start;
            const bool traced = begins || state.reuse.left == 0 || writer.due(state) || model.species.empty();
            SurfaceFlux surface =
                traced ? trace(begins) : carried_surface(model, state.stack, state.coverage, state.timing);
            if (traced) state.reuse.left = 0;  // a run resumed here traces, too
            const double to_stop = distance_to_stop(step, recipe.materials, state.stack, surface.raw);
            if (begins) note_stop(step, state.step, to_stop);
            if (to_stop == 0.0) break;
            levelset::Motion motion = surface_motion(model, state.stack, surface, state.timing);
            if (writer.due(state)) writer.save(state, model, surface);

            const double until = next_stop(state, recipe, state.step_start, step.duration);
            const double speed = fastest(model, levelset::max_speed(state.stack, motion));
            const double dt =
                std::min(time_step(until - state.time, speed, domain.spacing, recipe.advection.cfl),
                         approach(to_stop, speed, domain.spacing, recipe.advection.cfl));
            const FluxReuse reuse = next_reuse(recipe, model, state, begins, traced, surface);
            CoverageField carried = traced ? carried_field(recipe, model, surface) : state.coverage;
            const levelset::AdvectionOptions scheme = scheme_for(model, recipe.advection);
            std::vector<levelset::Motion> motions(1, std::move(motion));
            if (recipe.flux.stages == "all" && traced && !model.species.empty())
                add_stages(model, state, dt, scheme, motions, [&](const levelset::MaterialStack& reached) {
                    return trace_stage(reached, carried, motions.size());
                });
            // From here on the time step is made.
            writer.record(state, step, surface, dt, speed);
            state.reuse = reuse;
            state.coverage = std::move(carried);
            const auto seconds = levelset::advect(state.stack, motions, dt, scheme);
            state.timing.advect += seconds.advect;
            state.timing.redistance += seconds.redistance;
            state.advance(dt, until);
            progress.update(state.time,
                            fmt::format("step {}/{} {}", state.step + 1, steps.size(), step.name));
            count_total();
            if (interrupted() &&
                !(state.step + 1 == steps.size() && state.reached(state.step_start + step.duration)))
                stop();
        }
    }
    // The final surface, with the fluxes the last model would go on with; a run resumed here has made none
    // yet.
    for (const Step& step : steps)
        if (find_model(step.model)->make != nullptr)
            model = make_model(step, recipe.materials, recipe.domain);
    const SurfaceFlux surface = trace(false);
    writer.save(state, model, surface);
    count_total();
    RunResult result{surface.raw, state.timing, {}};
    result.summary = writer.finish(state, steps, surface);
    return result;
}

}  // namespace sidewall::app
