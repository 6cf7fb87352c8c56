#include "app/process/time_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidewall::app {
namespace {

// Process time at which equal time steps must end: the end of the recipe's step or the next surface to save.
double next_event(const Recipe& recipe, const Step& step, const RunState& state) {
    const double end = state.step_start + step.duration;
    return recipe.output.every ? std::min(end, static_cast<double>(state.saved) * *recipe.output.every) : end;
}

// Equal parts of what is left, each moving the front at most cfl dx.
double equal_parts(double left, double speed, double spacing, double cfl) {
    if (speed <= 0.0) return left;
    // Rounding just above a whole number of time steps must not cost one more. 1e-9 is beyond the rounding of
    // a time that 1e6 time steps added up to, and lengthens a time step by no more than that share.
    const double parts = std::ceil(left * speed / (cfl * spacing) * (1.0 - 1e-9));
    return left / std::max(1.0, parts);
}

// The longest time step towards a stop condition. Where the condition is met the front may be slower than the
// fastest point, and what is left would shrink from time step to time step without end: so a time step is at
// least a tenth of a full one, which may overshoot by a twentieth of a grid spacing (cfl is at most 0.5).
double approach(double distance, double speed, double spacing, double cfl) {
    return speed > 0.0 ? std::max(distance, 0.1 * cfl * spacing) / speed
                       : std::numeric_limits<double>::infinity();
}

// A step that would take this many time steps is a mistake in a rate or a duration.
constexpr double kMostTimeSteps = 1e7;

void refuse_endless(const Recipe& recipe, const Step& step, double left, double speed, double spacing) {
    const double count = left * speed / (recipe.advection.cfl * spacing);
    if (count > kMostTimeSteps)
        throw RecipeError(fmt::format(
            "{}: step {}: the surface moves at {:.3g} {}/{}, so that its {:g} {} would take {:.2g} time steps, over "
            "{:g}: check its rates and duration, or use a larger advection.cfl or domain.grid_spacing",
            recipe.file, step.name, speed, recipe.domain.length_unit, recipe.domain.time_unit, step.duration,
            recipe.domain.time_unit, count, kMostTimeSteps));
}

// Equal parts of what is left, each at most the share of the step that the model asks for.
double in_equal_parts(const Step& step, const Model& model, double left) {
    const double longest = step.duration / model.least_time_steps;
    return left / std::max(1.0, std::ceil(left / longest * (1.0 - 1e-9)));
}

// Up to the next of the step's parts whose ends are squares: (k/n)^2 of it.
double in_growing_parts(const Step& step, const Model& model, const RunState& state, double left) {
    const double n = model.least_time_steps, done = state.time - state.step_start;
    // 1e-6 of a part is beyond the rounding of a time that many time steps added up to, at its root, too.
    double k = std::floor(n * std::sqrt(std::max(0.0, done / step.duration)) + 1e-6) + 1.0;
    const auto part_until = [&](double end) { return step.duration * (end / n) * (end / n) - done; };
    // Late in a process a part may be less than what its time is known to: the next ones go with it.
    const double resolved = 8.0 * std::numeric_limits<double>::epsilon() * state.time;
    while (k < n && part_until(k) <= resolved) ++k;
    const double part = part_until(k);
    return part < left * (1.0 - 1e-9) ? part : left;
}

// What bounds the time step. A sharp V(n) moves kinks faster than any point of a plane.
double bounding_speed(const Model& model, double speed) {
    return model.depends_on_normal && speed > 0.0 ? std::max(speed, model.max_speed.value_or(0.0)) : speed;
}

}  // namespace

TimeStep choose_time_step(const Recipe& recipe, const Step& step, const Model& model, const RunState& state,
                          const levelset::Motion& motion, double to_stop) {
    TimeStep next;
    const double spacing = state.stack.domain.spacing, cfl = recipe.advection.cfl;
    next.until = next_event(recipe, step, state);
    next.speed = bounding_speed(model, levelset::max_speed(state.stack, motion));
    if (next.speed > 0.0) {
        const double left = state.step_start + step.duration - state.time;
        refuse_endless(recipe, step, std::min(left, to_stop / next.speed), next.speed, spacing);
    }
    next.dt = std::min(equal_parts(next.until - state.time, next.speed, spacing, cfl),
                       approach(to_stop, next.speed, spacing, cfl));
    const double left = next.until - state.time;
    if (model.least_time_steps > 1)
        next.dt = std::min(next.dt, model.growing_time_steps ? in_growing_parts(step, model, state, left)
                                                             : in_equal_parts(step, model, left));
    return next;
}

levelset::AdvectionOptions scheme_for(const Model& model, levelset::AdvectionOptions options) {
    if (model.depends_on_normal) options.scheme = levelset::Scheme::lax_friedrichs;
    return options;
}

}  // namespace sidewall::app
