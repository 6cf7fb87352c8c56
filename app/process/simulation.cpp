#include "app/process/simulation.hpp"

#include <fmt/format.h>
#include <tbb/tick_count.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "app/common/console.hpp"
#include "app/models/geometric_steps.hpp"
#include "app/process/arriving/coverages.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/trace.hpp"
#include "app/process/arriving/traced_mesh.hpp"
#include "app/process/endpoint.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/process/events.hpp"
#include "app/process/noise.hpp"
#include "app/process/record/run_folder.hpp"
#include "app/process/revision.hpp"
#include "app/process/time_step.hpp"
#include "app/process/wafer.hpp"
#include "app/results/metrology.hpp"
#include "app/results/result.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/volume.hpp"
#include "levelset/motion/motion.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Process time completed so far, for progress: a step that a stop condition ended counts as whole.
double time_done(const std::vector<Step>& steps, const RunState& state) {
    double sum = state.time - state.step_start;
    for (std::size_t k = 0; k < std::min(state.step, steps.size()); ++k) sum += steps[k].duration;
    return sum;
}

// What is constant during a run, and its folder and progress bar.
struct Run {
    const Recipe& recipe;
    const std::vector<Step>& steps;  // loops unrolled
    const RunOptions& options;
    RunFolder& folder;
    ProgressBar& progress;
    tbb::tick_count start;      // when this part of the run began
    double seconds_before = 0;  // wall time of earlier parts, before a resume
    std::set<std::string>& reported_methods;
    const std::vector<std::optional<double>>& noise;  // by step: flux error allowed in a time step

    void update(const RunState& state, std::string_view note) const {
        progress.update(time_done(steps, state), note);
    }
    void count_seconds(Timing& timing) const {
        timing.total = seconds_before + (tbb::tick_count::now() - start).seconds();
    }
    void warn(const std::string& text) const {
        if (!text.empty() && options.warn) options.warn(text);
    }
};

// Records and prints the events that a step has caused.
void report_events(const Run& run, const TriangleMesh& surface,
                   const std::vector<levelset::SurfacePiece>& pieces, std::size_t step, RunState& state) {
    const PhaseClock clock(state.timing.output);
    const std::size_t count = note_events(run.recipe, surface, pieces, step, state);
    const std::vector<Event>& events = state.history.events;
    for (std::size_t k = events.size() - count; k < events.size(); ++k)
        run.progress.line(event_line(run.recipe, run.steps, events[k]));
}

// Attributes the events at the start of a step to the step before, which made this surface.
void report_events(const Run& run, const TracedSurface& surface, RunState& state) {
    const std::size_t step = state.begins_step() && state.step > 0 ? state.step - 1 : state.step;
    report_events(run, surface.raw, surface.pieces, step, state);
}

// Measures the wafer at the step's end, accounts for volumes added and removed, and drops layers etched away.
void close_step(const Run& run, const Step& step, const TriangleMesh& surface, RunState& state) {
    const PhaseClock clock(state.timing.output);
    StepEnd end = end_of(run.recipe, step, state, surface);
    if (const std::string line = end_line(run.recipe, step, state, end); !line.empty())
        run.progress.line(line);
    run.folder.record_end(state, step, surface, end.measures);
    const GeometricStep* geometric = geometric_step(step.parameters);
    const std::optional<int> grown =
        geometric ? material_id(run.recipe.materials, geometric->material) : step.built->deposit;
    // A caller's own speed law may grow any material.
    const auto may_grow = [&](int material) { return run.options.speeds || grown == material; };
    end_step(state.stack, state.step, std::move(end), may_grow, state.history);
    if (levelset::drop_spent_layers(state.stack, state.history.layer_volumes))
        note_layers(state.stack, state.history);
}

// Name of the step that has just ended; empty within a step.
std::string ended_step(const Run& run, const RunState& state) {
    return state.begins_step() && state.step > 0 ? run.steps[state.step - 1].name : "";
}

// Does a geometric step, after saving the wafer before it if that is due; returns false for other steps.
bool reshape_at_once(const Run& run, const Step& step, RunState& state) {
    if (step.built) return false;
    if (state.step > 0 && !run.recipe.output.every && run.folder.due(state)) {
        run.folder.save(state, still_model(), extract(state.stack, 0.0, state.timing),
                        ended_step(run, state));
        run.folder.checkpoint(state);
    }
    run.warn(strip_warning(run.recipe, step, state.step + 1, state.stack));
    reshape(run.recipe, step, state.stack);
    const TriangleMesh surface = levelset::extract_surface(state.stack);
    report_events(run, surface, levelset::surface_pieces(surface, state.stack), state.step, state);
    close_step(run, step, surface, state);
    return true;
}

Model begin_step(const Run& run, const Step& step, RunState& state) {
    require_values(run.recipe, step, state.stack);
    Model model = model_with_law(run.recipe, run.options.speeds, step);
    if (model.deposit) levelset::begin_film(state.stack, *model.deposit);
    state.begin_step(step.duration);
    return model;
}

// Time since the current step began; after the last step, since the last one that takes time began.
double time_in_step(const Run& run, const RunState& state) {
    if (state.step < run.steps.size()) return state.time - state.step_start;
    std::size_t k = run.steps.size() - 1;
    while (k > 0 && !run.steps[k].built) --k;
    return std::max(0.0, state.since(state.starts[k]));
}

TraceRequest request_of(const Run& run, std::uint32_t key, bool settle, const RunState& state) {
    return {.key = key,
            .settle = settle,
            .progress = [&](double part) { run.update(state, fmt::format("tracing {:.0f} %", 100 * part)); },
            .time = time_in_step(run, state),
            .stop = run.options.stop,
            .noise = noise_allowed(run.recipe, run.steps, run.noise, state),
            .methods = state.methods,
            .shares = run.options.shares,
            .warn = run.options.warn};
}

// Prints the method that [flux] method = "auto" chose for each species, once per distinct choice.
void report_methods(const Run& run, const Step& step, const TracedSurface& surface) {
    const std::vector<SpeciesMethod>& methods = surface.arriving->trace->methods;
    if (run.recipe.flux.method != "auto" || methods.empty()) return;
    const std::string mesh = surface.simplified ? "a coarsened mesh" : "the surface as extracted";
    std::string choice = step.model + mesh;
    for (const SpeciesMethod& of : methods) choice += ' ' + of.species + ' ' + method_name(of);
    if (run.reported_methods.insert(choice).second)
        run.progress.line(fmt::format("step {}: {}; on {}", step.name, describe(methods), mesh));
}

// Whether the fluxes of the last trace serve this time step, too.
bool reuses_fluxes(const Run& run, const Model& model, const RunState& state) {
    return state.reuse.left > 0 && !state.begins_step() && !run.folder.due(state) && !model.species.empty() &&
           !model.coverages.transient;  // they change in every time step
}

// The surface at this time and its fluxes: extract, simplify, trace. Coverages react between traces.
TracedSurface surface_with_fluxes(const Run& run, const Model& model, const Step& step, RunState& state) {
    TracedSurface surface = extract(state.stack, time_in_step(run, state), state.timing);
    if (reuses_fluxes(run, model, state)) {
        reuse_fluxes(run.recipe, model, state.stack, state.carried, surface, state.timing);
        return surface;
    }
    state.reuse.left = 0;  // so that a run resumed here traces as well
    if (state.begins_step()) state.methods.clear();
    const TraceRequest request = request_of(run, state.time_step, state.begins_step(), state);
    simplify(run.recipe, model, state.stack, state.carried, request.noise, surface, state.timing);
    trace(run.recipe, model, state.stack, state.carried, request, surface, state.timing);
    if (request.methods.empty() && surface.arriving) {
        state.methods = surface.arriving->trace->methods;
        report_methods(run, step, surface);
    }
    return surface;
}

// The motion of every Runge-Kutta stage. The first one serves all stages unless the recipe traces each of
// them, with its own random numbers.
std::vector<levelset::Motion> stage_motions(const Run& run, const Model& model, levelset::Motion first,
                                            const TracedSurface& surface, const SurfaceField& carried,
                                            double dt, RunState& state) {
    std::vector<levelset::Motion> motions;
    motions.push_back(std::move(first));
    if (run.recipe.flux.stages != "all" || !surface.arriving || !surface.arriving->trace) return motions;
    constexpr int kStageBit = 30;  // in the random numbers' key
    const levelset::AdvectionOptions scheme = scheme_for(motions.front().law, run.recipe.advection);
    while (motions.size() < levelset::stage_count(scheme.time_integration)) {
        levelset::MaterialStack reached = levelset::copy(state.stack);
        levelset::advect_to_stage(reached, motions, dt, scheme);
        const auto stage = static_cast<std::uint32_t>(motions.size());
        TraceRequest request = request_of(run, state.time_step | stage << kStageBit, false, state);
        request.time += stage == 1 ? dt : 0.5 * dt;  // of stages of rk2 and rk3
        const auto traced = trace_surface(run.recipe, model, reached, carried, request, state.timing);
        motions.push_back(surface_motion(model, reached, traced, state.timing));
    }
    return motions;
}

// Advances the surface and the time; every few time steps chooses the columns of the grid levels anew.
void advance(const Recipe& recipe, const std::vector<levelset::Motion>& motions, const TimeStep& next,
             RunState& state) {
    const bool anew = state.chooses_columns();
    const auto wanted = anew ? levelset::columns_of_speed(state.stack, motions.front())
                             : std::vector<levelset::LevelColumns>();
    advect(recipe, motions, next, state.stack, state.timing);
    if (anew) {  // even if nothing moves: the next time steps may differ
        const PhaseClock clock(state.timing.redistance);
        levelset::choose_columns(state.stack, wanted);
    }
    state.advance(next.dt, next.until);
}

// Between two time steps the state is complete: checkpoints are written and a request to stop is obeyed here.
void end_time_step(const Run& run, const Step& step, RunState& state) {
    run.update(state, fmt::format("step {}/{} {}", state.step + 1, run.steps.size(), step.name));
    run.count_seconds(state.timing);
    flux::of_first(run.options.shares, 0);  // synchronises the ranks, so that all agree on stopping
    if (const std::uint32_t every = run.options.checkpoint_every; every > 0 && state.time_step % every == 0)
        run.folder.checkpoint(state);
    const bool last = state.step + 1 == run.steps.size() && state.reached(step_end(step, state));
    if (run.options.stop() && !last) throw Interrupted("");
}

// One time step: extract, simplify, trace, react, rates, advect, record.
// \returns the surface, without having moved it, if the step ends here by its stop condition; else null.
std::shared_ptr<const TracedSurface> make_time_step(const Run& run, const Step& step, const Model& model,
                                                    RunState& state) {
    const Recipe& recipe = run.recipe;
    // Extract, simplify, trace.
    auto surface = std::make_shared<const TracedSurface>(surface_with_fluxes(run, model, step, state));
    report_events(run, *surface, state);
    if (!state.endpoint.masks) note_masks(recipe, step, model, surface->raw, state);
    auto [to_stop, key] = distance_to_stop(recipe, step, state, surface->raw);
    if (state.begins_step() && !state.endpoint.time)
        run.warn(stop_warning(recipe, step, state.step + 1, to_stop));
    if (to_stop == 0.0) {
        note_endpoint(recipe, step, key, surface->raw, state);
        to_stop = StopDistance().left;
    }
    const bool ends = state.reached(step_end(step, state));
    if (run.folder.due(state) && (!ends || state.begins_step())) {
        run.folder.save(state, model, *surface, ended_step(run, state));
        run.folder.checkpoint(state);
    }
    if (ends) return surface;
    // Rates.
    levelset::Motion motion = motion_in_time_step(recipe, model, *surface, state);
    const TimeStep next = choose_time_step(recipe, step, model, state, motion, to_stop);
    // React: coverages at the end of the time step. Reused fluxes yield no new field to carry.
    const FluxReuse reuse = next_reuse(recipe.flux.reuse, model, state.reuse,
                                       state.begins_step() ? nullptr : &state.carried, *surface);
    std::optional<SurfaceField> fresh;
    if (!surface->arriving)
        fresh.emplace();
    else if (surface->arriving->trace)
        fresh = field_to_carry(recipe, model, *surface, coverages_after(model, *surface, next.dt));
    const std::vector<levelset::Motion> motions = stage_motions(
        run, model, std::move(motion), *surface, fresh ? *fresh : state.carried, next.dt, state);
    // Called before anything is recorded: a run that the observer interrupts resumes with this time step.
    if (run.options.observe) run.options.observe({step, model, state, surface, next.dt});
    // Record, advect.
    run.folder.record(state, step, *surface, next);
    state.reuse = reuse;
    if (fresh) state.carried = std::move(*fresh);
    advance(recipe, motions, next, state);
    end_time_step(run, step, state);
    return nullptr;
}

// The time loop.
void make_steps(const Run& run, RunState& state) {
    for (; state.step < run.steps.size(); state.enter(state.step + 1)) {
        const Step& step = run.steps[state.step];
        if (reshape_at_once(run, step, state)) continue;
        const Model model = begin_step(run, step, state);
        std::shared_ptr<const TracedSurface> last;
        while (!last && !state.reached(step_end(step, state))) last = make_time_step(run, step, model, state);
        const TriangleMesh surface = levelset::extract_surface(state.stack);
        if (!state.endpoint.time)
            run.warn(missing_figure_warning(run.recipe, step, state.step + 1, state.stack, surface));
        close_step(run, step, surface, state);
    }
}

// The model of the last step that takes time; a model without motion if there is none.
Model last_model(const Run& run) {
    for (auto step = run.steps.rbegin(); step != run.steps.rend(); ++step)
        if (step->built) return model_with_law(run.recipe, run.options.speeds, *step);
    return still_model();
}

// Saves the final surface, with fluxes by the last model, and the summary. The checkpoint precedes that
// surface: a longer recipe resumes from it as if the run had been its own.
RunResult finish(const Run& run, RunState& state) {
    run.folder.checkpoint(state);
    const Model model = last_model(run);
    const auto surface = std::make_shared<const TracedSurface>(
        trace_surface(run.recipe, model, state.stack, state.carried,
                      request_of(run, state.time_step, false, state), state.timing));
    report_events(run, *surface, state);
    run.folder.save(state, model, *surface, ended_step(run, state));
    run.count_seconds(state.timing);
    RunResult result{surface->raw, state.timing, run.folder.finish(state, run.steps, *surface)};
    run.warn(scallop_note(run.recipe, result.summary["metrology"]));
    if (run.options.observe && !run.steps.empty())
        run.options.observe({run.steps.back(), model, state, surface, 0.0, &result.summary});
    return result;
}

std::string how_to_go_on(const Run& run, const RunState& state) {
    const std::string& resume = run.options.resume_command;
    return fmt::format(
        "stopped at {:.6g} of {:.6g} {}; {}", state.process_time(), total_duration(run.steps),
        run.recipe.domain.time_unit,
        resume.empty() ? "what is finished is in " + run.options.output.string() : "go on with: " + resume);
}

// Makes the remaining steps and finishes the run. If interrupted, writes a checkpoint and says how to resume.
RunResult make_run(const Run& run, RunState& state) {
    try {
        make_steps(run, state);
        return finish(run, state);
    } catch (const Interrupted&) {
        // Thrown while tracing or between time steps: the state is that after the last complete time step.
        run.count_seconds(state.timing);
        run.folder.checkpoint(state);
        throw Interrupted(how_to_go_on(run, state));
    } catch (const IoError& error) {
        const std::string& resume = run.options.resume_command;
        if (resume.empty() || !std::filesystem::exists(run.options.output / "checkpoint.vdb")) throw;
        throw IoError("{}; then go on with: {}", error.what(), resume);
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
    Recipe recipe = began_with;  // a copy: the observer may change it
    require_memory(recipe, domain_of(recipe), options.processes_here);
    std::vector<Step> steps = expanded_steps(recipe);
    RunFolder folder(options, recipe);
    RunState state = folder.goes_on() ? resume_state(options.output, recipe) : built_wafer(recipe, options);
    flux::of_first(options.shares, 0);  // waits until all ranks have read what rank 0 will change
    if (folder.goes_on() && folder.finished() && state.step >= steps.size()) {
        folder.require_unchanged(state);
        const Json summary = read_whole_summary(options.output);
        return {levelset::extract_surface(state.stack), summary.at("timing").get<Timing>(), summary};
    }
    std::optional<std::filesystem::file_time_type> extended;  // when the checkpoint was written
    if (folder.goes_on() && folder.finished())                // of a finished run
        extended = std::filesystem::last_write_time(options.output / "checkpoint.vdb");
    try {
        folder.begin(state);
        ProgressBar progress(options.title, total_duration(steps), recipe.domain.time_unit, !options.quiet,
                             {.from = time_done(steps, state), .tenths = true});
        std::set<std::string> reported;
        std::vector<std::optional<double>> noise = noise_of_time_steps(recipe, steps);
        const Run run{recipe,   steps, options, folder, progress, tbb::tick_count::now(), state.timing.total,
                      reported, noise};
        for (;;) {
            try {
                return make_run(run, state);
            } catch (const Revised& revised) {
                recipe = *revised.recipe;
                const std::vector<Step> before = std::exchange(steps, expanded_steps(recipe));
                if (state.step < before.size() &&
                    !same_stop_conditions(steps[state.step], before[state.step]))
                    state.endpoint = {};
                state.reuse = {};  // the last trace belongs to the old recipe
                state.methods.clear();
                noise = noise_of_time_steps(recipe, steps);
                folder.revise(state);
            }
        }
    } catch (const Interrupted&) {
        throw;
    } catch (...) {
        if (extended) rethrow_with_undo_advice(options.output, *extended);
        throw;
    }
}

}  // namespace sidewall::app
