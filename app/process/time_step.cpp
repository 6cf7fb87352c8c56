#include "app/process/time_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/endpoint.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/results/figure_values.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"
#include "surface/ray_scene.hpp"
#include "surface/turn.hpp"

namespace sidewall::app {
namespace {

// Distance in grid spacings at which a front counts as arrived: re-distancing keeps its position no better.
constexpr double kArrived = 1e-3;

double lowest(const TriangleMesh& surface) {
    double z = kInfinity;
    for (const Vec3& p : surface.vertices) z = std::min(z, p.z());
    return z;
}

double thickest(const levelset::MaterialStack& stack, const TriangleMesh& surface) {
    if (stack.layers.size() < 2) return 0.0;
    const TriangleMesh below = levelset::extract_surface(stack, stack.layers.size() - 2);
    if (below.triangles.empty()) return 0.0;
    const surface::RayScene scene(below);
    double most = 0.0;
    for (const Vec3& p : surface.vertices)
        most = std::max(most, scene.closest_point(p, kInfinity, stack.domain.period()).distance);
    return most;
}

// Least distance that the front must move before the bare share of the floor is above the rule's value. For a
// rule "below": 0 if it holds, else infinity.
double way_to_bare(const StopRule& rule, const RunState& state, const TriangleMesh& surface) {
    const BareFloor floor = bare_floor(state.stack, surface, rule.bare,
                                       state.endpoint.masks.value_or(std::vector<int>()), rule.value);
    if (rule.above) return floor.share > rule.value ? 0.0 : floor.left;
    return floor.share < rule.value && std::isfinite(floor.left) ? 0.0 : kInfinity;
}

// Least distance that the front moves before the figure passes the rule's value; infinite if unknown.
double distance_to_figure(const StopRule& rule, const Recipe& recipe, const levelset::MaterialStack& stack,
                          const TriangleMesh& surface) {
    const Measure now = measure_named(recipe, rule.figure, stack, surface);
    const double left = rule.above ? rule.value - now.value : now.value - rule.value;
    if (!std::isfinite(left)) return kInfinity;  // the wafer has no such figure yet
    // A dimensionless figure, such as a number of voids, must pass the value; others need only reach it.
    if (left < 0.0 || (left == 0.0 && now.unit != "1")) return 0.0;
    const std::string& length = recipe.domain.length_unit;
    if (now.unit == length) return rule.figure == "depth" ? left : 0.5 * left;
    if (now.unit == volume_unit(recipe)) {
        const levelset::Domain& domain = stack.domain;
        // Bounds the area of an axial wafer by that of its profile turned at the outer radius.
        const double width = domain.axial ? share_of_turn(domain.max[1] - domain.min[1], domain.max[0])
                                          : volume_divisor(recipe);
        return left * width / total_area(surface);
    }
    return kInfinity;
}

// Time at which the equal time steps end: the end of the recipe's step or the next surface to save.
double next_event(const Recipe& recipe, const Step& step, const RunState& state) {
    const double end = step_end(step, state);
    if (!recipe.output.every) return end;
    const double save = state.next_save(*recipe.output.every);
    return save < end - kSameTime * *recipe.output.every ? save : end;
}

// The longest time step towards a stop condition. Where the condition is met, the front may be slower than
// its fastest point, and the remaining distance would shrink without end. So a time step is at least a tenth
// of a full one, which overshoots by at most a twentieth of a grid spacing (cfl is at most 0.5).
double approach(double distance, double speed, double spacing, double cfl) {
    return speed > 0.0 ? std::max(distance, 0.1 * cfl * spacing) / speed : kInfinity;
}

// A step that needs more time steps than this has a mistake in a rate or its duration.
constexpr double kMostTimeSteps = 1e7;

void refuse_endless(const Recipe& recipe, const Step& step, double left, double speed, double spacing) {
    const double count = left * speed / (recipe.advection.cfl * spacing);
    if (count > kMostTimeSteps)
        throw RecipeError(
            "{}: step {}: the surface moves at {:.3g} {}/{}, so that its {:g} {} would take {:.2g} time steps, over "
            "{:g}: check its rates and duration, or use a larger advection.cfl or domain.grid_spacing",
            recipe.file, step.name, speed, recipe.domain.length_unit, recipe.domain.time_unit, step.duration,
            recipe.domain.time_unit, count, kMostTimeSteps);
}

// Equal parts of the remaining time, each at most the share of the step that the model asks for.
double in_equal_parts(const Step& step, const Model& model, double left) {
    const double longest = step.duration / model.min_time_steps;
    return left / std::max(1.0, std::ceil(left / longest * (1.0 - 1e-9)));
}

// Time to the end of the current one of n parts, the k-th of which ends at (k/n)^2 of the step.
double in_growing_parts(const Step& step, const Model& model, const RunState& state, double left) {
    const double n = model.min_time_steps, done = state.time - state.step_start;
    // 1e-6 of a part exceeds the rounding of a time summed over many time steps, also of its root.
    double k = std::floor(n * std::sqrt(std::max(0.0, done / step.duration)) + 1e-6) + 1.0;
    const auto part_until = [&](double end) { return step.duration * (end / n) * (end / n) - done; };
    // Late in a process a part may be shorter than the rounding of the time: it is merged with the next ones.
    const double resolved = 8.0 * std::numeric_limits<double>::epsilon() * state.time;
    while (k < n && part_until(k) <= resolved) ++k;
    const double part = part_until(k);
    return part < left * (1.0 - 1e-9) ? part : left;
}

// The speed that bounds the time step. With a sharp V(n), kinks move faster than any plane.
double bounding_speed(const Model& model, double speed) {
    return model.depends_on_normal && speed > 0.0 ? std::max(speed, model.hints.max_speed.value_or(0.0))
                                                  : speed;
}

}  // namespace

StopDistance distance_to_stop(const Recipe& recipe, const Step& step, const RunState& state,
                              const TriangleMesh& surface) {
    const levelset::MaterialStack& stack = state.stack;
    StopDistance nearest;
    if (state.endpoint.time) return nearest;
    const auto consider = [&](double left, const char* key) {
        if (left < nearest.left) nearest = {left, key};
    };
    if (step.stop_depth) consider(*step.stop_depth + lowest(surface), "stop_depth");
    if (step.stop_thickness) consider(*step.stop_thickness - thickest(stack, surface), "stop_thickness");
    const auto bare = bare_rule(recipe, step);
    if (!step.stop.empty() && !(bare && step.stop_material.empty()))
        consider(distance_to_figure(stop_rule(recipe, step.stop), recipe, stack, surface), "stop");
    if (nearest.left <= kArrived * stack.domain.spacing) nearest.left = 0.0;
    if (bare)
        consider(way_to_bare(*bare, state, surface), step.stop_material.empty() ? "stop" : "stop_material");
    return nearest;
}

std::string stop_warning(const Recipe& recipe, const Step& step, std::size_t number, double to_stop) {
    const std::string& name = step.name.empty() ? step.model : step.name;
    if (to_stop == 0.0)
        return fmt::format("step {} ({}): its stop condition holds before it begins: {}", number, name,
                           step.over_etch_time > 0.0 ? "it over-etches only" : "it does nothing");
    const auto rule = bare_rule(recipe, step);
    if (std::isinf(to_stop) && rule && rule->above)
        return fmt::format("step {} ({}): there is no {} under an opening for its stop condition to meet",
                           number, name, recipe.materials[static_cast<std::size_t>(rule->bare)].name);
    return {};
}

std::string missing_figure_warning(const Recipe& recipe, const Step& step, std::size_t number,
                                   const levelset::MaterialStack& stack, const TriangleMesh& surface) {
    if (step.stop.empty()) return {};
    const StopRule rule = stop_rule(recipe, step.stop);
    const std::string& figure = rule.figure;
    if (rule.bare >= 0 || std::isfinite(measure_named(recipe, figure, stack, surface).value)) return {};
    return fmt::format(
        "step {} ({}): ended by its duration: it was to stop at {}, which the wafer does not have", number,
        step.name.empty() ? step.model : step.name, figure);
}

levelset::Motion motion_in_time_step(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                                     RunState& state) {
    const auto motion_by = [&](const TracedSurface& from) {
        return surface_motion(model, state.stack, from, state.timing, state.chooses_columns());
    };
    if (!surface.arriving || !surface.arriving->trace || state.begins_step() || model.coverages.transient ||
        recipe.flux.reuse > 0.0 || recipe.flux.stages == "all" ||
        state.reuse.since == 0)  // the last trace was of another recipe
        return motion_by(surface);
    const double share = state.time_steps[state.step] == 1 ? 1.0 : 0.5;
    return motion_by(with_later_fluxes(model, state.carried, surface, share));
}

double equal_time_steps(double duration, double speed, double spacing, double cfl) {
    // A quotient just above a whole number by rounding must not cost one more time step. 1e-9 exceeds the
    // rounding of a time summed over 1e6 time steps, and lengthens a time step by at most that share.
    return std::max(1.0, std::ceil(duration * speed / (cfl * spacing) * (1.0 - 1e-9)));
}

TimeStep choose_time_step(const Recipe& recipe, const Step& step, const Model& model, const RunState& state,
                          const levelset::Motion& motion, double to_stop) {
    TimeStep next;
    const double spacing = state.stack.domain.spacing, cfl = recipe.advection.cfl;
    next.until = next_event(recipe, step, state);
    next.speed = bounding_speed(model, levelset::max_speed(state.stack, motion));
    if (next.speed > 0.0) {
        const double left = step_end(step, state) - state.time;
        refuse_endless(recipe, step, std::min(left, to_stop / next.speed), next.speed, spacing);
    }
    const double left = next.until - state.time;
    next.dt = std::min(left / equal_time_steps(left, next.speed, spacing, cfl),
                       approach(to_stop, next.speed, spacing, cfl));
    if (model.min_time_steps > 1)
        next.dt = std::min(next.dt, model.parabolic_time_steps ? in_growing_parts(step, model, state, left)
                                                               : in_equal_parts(step, model, left));
    return next;
}

levelset::AdvectionOptions scheme_for(const levelset::SpeedLaw& law, levelset::AdvectionOptions options) {
    if (law.depends_on_normal) options.scheme = levelset::Scheme::lax_friedrichs;
    return options;
}

void advect(const Recipe& recipe, const std::vector<levelset::Motion>& motions, const TimeStep& next,
            levelset::MaterialStack& stack, Timing& timing) {
    // If nothing moves, the grids stay untouched: re-distancing would shift the front by 1e-3 cells.
    const bool moves = next.speed > 0.0 || std::ranges::any_of(motions, [&](const levelset::Motion& motion) {
                           return levelset::max_speed(stack, motion) > 0.0;
                       });
    if (!moves) return;
    const auto seconds =
        levelset::advect(stack, motions, next.dt, scheme_for(motions.front().law, recipe.advection));
    timing.advect += seconds.advect;
    timing.redistance += seconds.redistance;
}

}  // namespace sidewall::app
