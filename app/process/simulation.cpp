#include "app/process/simulation.hpp"

#include <fmt/format.h>
#include <tbb/tick_count.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>

#include "app/common/progress.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/arriving/flux_reuse.hpp"
#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/process/events.hpp"
#include "app/process/record/run_folder.hpp"
#include "app/process/reshape.hpp"
#include "app/process/revision.hpp"
#include "app/process/start.hpp"
#include "app/process/state.hpp"
#include "app/process/stop.hpp"
#include "app/process/time_step.hpp"
#include "app/recipe/step_materials.hpp"
#include "app/results/metrology.hpp"
#include "app/results/whole_summary.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kDuration = "duration";  // what ends a step that nothing stops

// Process time behind the state, for progress: a step that a condition stopped counts as whole.
double time_done(const std::vector<Step>& steps, const RunState& state) {
    double sum = state.time - state.step_start;
    for (std::size_t k = 0; k < std::min(state.step, steps.size()); ++k) sum += steps[k].duration;
    return sum;
}

// What stays the same all through a run, its folder and its progress bar.
struct Run {
    const Recipe& recipe;
    const std::vector<Step>& steps;  // loops unrolled
    const RunOptions& options;
    RunFolder& folder;
    ProgressBar& progress;
    tbb::tick_count start;      // of this part of the run,
    double seconds_before = 0;  // and what the parts before it took
    std::set<std::string>& told_methods;

    void update(const RunState& state, std::string_view note) const {
        progress.update(time_done(steps, state), note);
    }
    void count_seconds(Timing& timing) const {
        timing.total = seconds_before + (tbb::tick_count::now() - start).seconds();
    }
};

// Says what has happened to the wafer by the work of a step.
void tell_events(const Run& run, const TriangleMesh& surface,
                 const std::vector<levelset::SurfacePiece>& pieces, std::size_t step, RunState& state) {
    const PhaseClock clock(state.timing.output);
    const std::size_t count = note_events(run.recipe, surface, pieces, step, state);
    const std::vector<Event>& events = state.history.events;
    for (std::size_t k = events.size() - count; k < events.size(); ++k)
        run.progress.line(event_line(run.recipe, run.steps, events[k]));
}

// The surface at the start of a step is the work of the one before.
void tell_events(const Run& run, const TracedSurface& surface, RunState& state) {
    const std::size_t step = state.begins_step() && state.step > 0 ? state.step - 1 : state.step;
    tell_events(run, surface.raw, surface.pieces, step, state);
}

void end_step(const char* stopped_by, RunState& state) {
    const PhaseClock clock(state.timing.output);
    end_step(state.stack, state.step, {state.time - state.step_start, stopped_by}, state.history);
}

// False if the step is not a geometric one.
bool reshape_at_once(const Run& run, const Step& step, RunState& state) {
    if (!reshape(run.recipe, step, state.stack)) return false;
    const TriangleMesh surface = levelset::extract_surface(state.stack);
    tell_events(run, surface, levelset::surface_pieces(surface, state.stack.domain), state.step, state);
    end_step(kDuration, state);
    return true;
}

// The reader asks for the materials of the recipe; a wafer that comes from elsewhere may hold others.
void require_values_on(const levelset::MaterialStack& stack, const Recipe& recipe, const Step& step) {
    try {
        require_values({step.name, &step, layer_materials(stack)}, recipe.materials);
    } catch (const KeyError& error) {
        throw RecipeError(fmt::format("{}: step {}: {}", recipe.file, step.name, error.what()));
    }
}

// The step's model, with the caller's law for its speed if there is one.
Model model_of(const Run& run, const Step& step) {
    Model model = *step.built;
    if (!run.options.speeds) return model;
    if (model.depends_on_normal)
        throw RecipeError(fmt::format(
            "{}: step {}: no other law can stand for a speed that turns with the normal, as that of {}",
            run.recipe.file, step.name, step.model));
    Model plain = model;
    model.speeds = [speeds = run.options.speeds, step, plain](std::span<const SurfacePoint> points) {
        return speeds(step, plain, points);
    };
    model.inert.clear();
    model.beam_speed = nullptr;
    return model;
}

Model begin_step(const Run& run, const Step& step, RunState& state) {
    require_values_on(state.stack, run.recipe, step);
    Model model = model_of(run, step);
    if (model.deposit) levelset::begin_film(state.stack, *model.deposit);
    return model;
}

// Process time at which the step at hand began; after the last one, the last that takes time.
double began(const Run& run, const RunState& state) {
    std::size_t k = std::min(state.step, run.steps.size() - 1);
    while (state.step == run.steps.size() && k > 0 && !run.steps[k].built) --k;
    return state.starts[k];
}

TracedSurface trace(const Run& run, const Model& model, const levelset::MaterialStack& stack,
                    const SurfaceField& carried, std::uint32_t key, bool settle, RunState& state) {
    const auto progress = [&](double part) {
        run.update(state, fmt::format("tracing {:.0f} %", 100 * part));
    };
    const double time = state.time - began(run, state);
    return trace_surface(run.recipe, model, stack, carried,
                         {key, settle, progress, time, run.options.stop, state.methods, run.options.shares},
                         state.timing);
}

// Says how the species of a step are traced where that was chosen, once for the steps that are alike.
void tell_methods(const Run& run, const Model& model, const Step& step, const RunState& state) {
    if (run.recipe.flux.method != "auto" || model.species.empty()) return;
    std::string choice = step.model;
    for (const SpeciesMethod& method : state.methods)
        choice += fmt::format(" {} {}", method.species, method_name(method));
    if (run.told_methods.insert(choice).second)
        run.progress.line(fmt::format("step {}: {}", step.name, describe(state.methods)));
}

// The surface at this time and what arrives on it, traced or, where the recipe allows it, carried over.
TracedSurface current_surface(const Run& run, const Model& model, const Step& step, RunState& state) {
    const bool carries_over = state.reuse.left > 0 && !state.begins_step() && !run.folder.due(state) &&
                              !model.species.empty() &&
                              !model.coverages.transient;  // which every time step changes
    if (carries_over)
        return carried_surface(model, state.stack, state.carried, state.time - state.step_start,
                               state.timing);
    state.reuse.left = 0;  // a run resumed here traces, too
    const bool begins = state.begins_step();
    if (begins) state.methods.clear();
    const bool chooses = state.methods.empty();
    TracedSurface surface = trace(run, model, state.stack, state.carried, state.time_step, begins, state);
    if (chooses && surface.arriving) {
        state.methods = surface.arriving->trace->methods;
        tell_methods(run, model, step, state);
    }
    return surface;
}

// The motion of every Runge-Kutta stage. Those after the first are traced only if the recipe asks for it,
// with random numbers of their own; else the first one serves them all.
std::vector<levelset::Motion> stage_motions(const Run& run, const Model& model, levelset::Motion first,
                                            const TracedSurface& surface, const SurfaceField& carried,
                                            double dt, RunState& state) {
    std::vector<levelset::Motion> motions;
    motions.push_back(std::move(first));
    if (run.recipe.flux.stages != "all" || !surface.arriving || !surface.arriving->trace) return motions;
    constexpr int kStageBit = 30;  // of the random numbers' key
    const levelset::AdvectionOptions scheme = scheme_for(model, run.recipe.advection);
    while (motions.size() < levelset::stage_count(scheme.time_integration)) {
        levelset::MaterialStack reached = levelset::copy(state.stack);
        levelset::advect_to_stage(reached, motions, dt, scheme);
        const std::uint32_t key = state.time_step | static_cast<std::uint32_t>(motions.size()) << kStageBit;
        motions.push_back(surface_motion(
            model, reached, trace(run, model, reached, carried, key, false, state), state.timing));
    }
    return motions;
}

// What a trace leaves for the next time step; nothing of fluxes that were carried over.
std::optional<SurfaceField> traced_field(const Recipe& recipe, const Model& model,
                                         const TracedSurface& surface, double dt) {
    if (surface.arriving && !surface.arriving->trace) return std::nullopt;
    return field_to_carry(recipe, model, surface, dt);
}

// Moves the surface.
void advance(const Recipe& recipe, const Model& model, const std::vector<levelset::Motion>& motions,
             const TimeStep& next, RunState& state) {
    // What stands still is left as it is: re-distancing would move it by a thousandth of a cell.
    const bool moves = next.speed > 0.0 || std::ranges::any_of(motions, [&](const levelset::Motion& motion) {
                           return levelset::max_speed(state.stack, motion) > 0.0;
                       });
    const bool anew = state.chooses_columns();
    std::vector<levelset::LevelColumns> wanted;
    if (anew) wanted = levelset::columns_of_speed(state.stack, motions.front());
    if (moves) {
        const auto seconds =
            levelset::advect(state.stack, motions, next.dt, scheme_for(model, recipe.advection));
        state.timing.advect += seconds.advect;
        state.timing.redistance += seconds.redistance;
    }
    if (anew) {  // also where nothing moves, as it may in the next time steps
        const PhaseClock clock(state.timing.redistance);
        levelset::choose_columns(state.stack, wanted);
    }
    state.advance(next.dt, next.until);
}

// Between two time steps the state is whole: the place to stop if the user asked for it.
void end_time_step(const Run& run, const Step& step, RunState& state) {
    run.update(state, fmt::format("step {}/{} {}", state.step + 1, run.steps.size(), step.name));
    run.count_seconds(state.timing);
    flux::of_first(run.options.shares, 0);  // agrees on whether to stop
    const bool last = state.step + 1 == run.steps.size() && state.reached(state.step_start + step.duration);
    if (run.options.stop() && !last) throw Interrupted("");
}

// The time loop.
void make_steps(const Run& run, RunState& state) {
    const Recipe& recipe = run.recipe;
    for (; state.step < run.steps.size(); state.enter(state.step + 1)) {
        const Step& step = run.steps[state.step];
        if (reshape_at_once(run, step, state)) continue;
        const Model model = begin_step(run, step, state);
        const char* stopped_by = kDuration;
        while (!state.reached(state.step_start + step.duration)) {
            const auto shared =
                std::make_shared<const TracedSurface>(current_surface(run, model, step, state));
            const TracedSurface& surface = *shared;
            tell_events(run, surface, state);
            const auto [to_stop, key] = distance_to_stop(recipe, step, state.stack, surface.raw);
            if (state.begins_step()) note_stop(step, state.step + 1, to_stop);
            if (to_stop == 0.0) {
                stopped_by = key;
                break;
            }
            if (run.folder.due(state)) {
                run.folder.save(state, model, surface);
                run.folder.checkpoint(state);
            }
            levelset::Motion motion =
                surface_motion(model, state.stack, surface, state.timing, state.chooses_columns());
            const TimeStep next = choose_time_step(recipe, step, model, state, motion, to_stop);
            const FluxReuse reuse = next_reuse(recipe.flux.reuse, model, state.reuse,
                                               state.begins_step() ? nullptr : &state.carried, surface);
            std::optional<SurfaceField> fresh = traced_field(recipe, model, surface, next.dt);
            const std::vector<levelset::Motion> motions = stage_motions(
                run, model, std::move(motion), surface, fresh ? *fresh : state.carried, next.dt, state);

            // Before anything of the time step is noted, so that a run which the observer interrupts goes on
            // with it.
            if (run.options.observe) run.options.observe({step, model, state, shared, next.dt});
            run.folder.record(state, step, surface, next);
            state.reuse = reuse;
            if (fresh) state.carried = std::move(*fresh);
            advance(recipe, model, motions, next, state);
            end_time_step(run, step, state);
        }
        if (stopped_by == kDuration) note_missing_figure(recipe, step, state.step + 1, state.stack);
        end_step(stopped_by, state);
    }
}

// The model whose fluxes a further time step would be made with; one that does nothing if no step takes time.
Model last_model(const Run& run) {
    for (auto step = run.steps.rbegin(); step != run.steps.rend(); ++step)
        if (step->built) return model_of(run, *step);
    Model still;
    still.speed = [](const SurfacePoint&) { return 0.0; };
    return still;
}

// Saves the final surface, with the fluxes that the last model would go on with, and the summary. The
// checkpoint knows nothing of that surface: a longer recipe goes on from it as if it had been this one's.
RunResult finish(const Run& run, RunState& state) {
    run.folder.checkpoint(state);
    const Model model = last_model(run);
    const auto surface = std::make_shared<const TracedSurface>(
        trace(run, model, state.stack, state.carried, state.time_step, false, state));
    tell_events(run, *surface, state);
    run.folder.save(state, model, *surface);
    run.count_seconds(state.timing);
    RunResult result{surface->raw, state.timing, run.folder.finish(state, run.steps, *surface)};
    if (run.options.observe && !run.steps.empty())
        run.options.observe({run.steps.back(), model, state, surface, 0.0, &result.summary});
    return result;
}

std::string how_to_go_on(const Run& run, const RunState& state) {
    const RunOptions& options = run.options;
    return fmt::format("stopped at {:.6g} of {:.6g} {}; {}", state.time, total_duration(run.steps),
                       run.recipe.domain.time_unit,
                       options.resume_command.empty() ? "what is finished is in " + options.output.string()
                                                      : "go on with: " + options.resume_command);
}

// What to do when a finished run's extension fails: the checkpoint may still be the finished run's.
void tell_way_back(const RunOptions& options, std::filesystem::file_time_type before) {
    std::error_code failure;
    const bool untouched =
        std::filesystem::last_write_time(options.output / "checkpoint.vdb", failure) == before;
    std::fputs(
        fmt::format("{}: the extension of the finished run there failed: {}\n", options.output.string(),
                    untouched ? "its checkpoint is as it was: --resume with the recipe as it was makes "
                                "the finished run's files again"
                              : "its checkpoint is of a later time: only this recipe or a longer one goes "
                                "on from there, with --resume")
            .c_str(),
        stderr);
}

// Ends the run, or says how to go on.
RunResult make_run(const Run& run, RunState& state) {
    const RunOptions& options = run.options;
    try {
        make_steps(run, state);
        return finish(run, state);
    } catch (const Interrupted&) {
        // Thrown while tracing or between time steps: the state is that of the last whole one.
        run.count_seconds(state.timing);
        run.folder.checkpoint(state);
        throw Interrupted(how_to_go_on(run, state));
    } catch (const IoError& error) {
        if (options.resume_command.empty() || !std::filesystem::exists(options.output / "checkpoint.vdb"))
            throw;
        throw IoError(fmt::format("{}; then go on with: {}", error.what(), options.resume_command));
    }
}

RunState built_wafer(const Recipe& recipe, const RunOptions& options) {
    try {
        return initial_state(recipe, options.stop);
    } catch (const Interrupted&) {
        throw Interrupted("stopped while the wafer was built: nothing has been written");
    }
}

}  // namespace

RunResult run_recipe(const Recipe& began_with, const RunOptions& options) {
    Recipe recipe = began_with;  // which the observer may change
    require_memory(recipe, domain_of(recipe), options.processes_here);
    std::vector<Step> steps = expanded_steps(recipe);
    RunFolder folder(options, recipe);
    RunState state = folder.goes_on() ? resume_state(options.output, recipe) : built_wafer(recipe, options);
    flux::of_first(options.shares, 0);  // all have read what rank 0 is about to change
    if (folder.goes_on() && folder.finished() && state.step >= steps.size()) {
        const Json summary = read_whole_summary(options.output);
        return {levelset::extract_surface(state.stack), timing_from_json(summary.at("timing")), summary};
    }
    // When the checkpoint was written, of a finished run that is extended.
    std::optional<std::filesystem::file_time_type> extended;
    if (folder.goes_on() && folder.finished())
        extended = std::filesystem::last_write_time(options.output / "checkpoint.vdb");
    try {
        folder.begin(state);
        ProgressBar progress(options.title, total_duration(steps), recipe.domain.time_unit, !options.quiet,
                             {.from = time_done(steps, state), .tenths = true});
        std::set<std::string> told;
        const Run run{recipe, steps, options, folder, progress, tbb::tick_count::now(), state.timing.total,
                      told};
        for (;;) {
            try {
                return make_run(run, state);
            } catch (const Revised& revised) {
                recipe = *revised.recipe;
                steps = expanded_steps(recipe);
                state.reuse = {};  // what was traced is of the recipe before
                state.methods.clear();
                folder.revise(state);
            }
        }
    } catch (const Interrupted&) {
        throw;
    } catch (...) {
        if (extended) tell_way_back(options, *extended);
        throw;
    }
}

}  // namespace sidewall::app
