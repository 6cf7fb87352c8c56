#include "app/process/revision.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "app/recipe/differences.hpp"
#include "app/recipe/steps.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// The fluxes' method is chosen at the start of a step.
bool may_change(const std::string& difference) {
    const auto of = [&](const char* section) { return difference.starts_with(section); };
    return (of("flux.") && !of("flux.method")) || of("simplify.") || of("advection.");
}

// The step with what may change as in \p other: the duration, the stop conditions and the model's values.
Step revised_as(Step step, const Step& other) {
    step.duration = other.duration;
    step.stop_depth = other.stop_depth;
    step.stop_thickness = other.stop_thickness;
    step.stop_material = other.stop_material;
    step.stop = other.stop;
    if (step.model != other.model) return step;
    Step revised = step;
    revised.parameters = other.parameters;
    if (auto* film = target_of<std::string>(keys_of(revised), "deposit"))
        *film = *target_of<std::string>(keys_of(step), "deposit");
    return revised;
}

}  // namespace

void require_revision(const Recipe& recipe, const Recipe& began_with, const RunState& state) {
    std::vector<std::string> list = differences(recipe, began_with);
    std::erase_if(list, may_change);
    const std::vector<Step> now = expanded_steps(recipe), there = expanded_steps(began_with);
    if (now.size() <= state.step)
        throw RecipeError(fmt::format("{}: the recipe has {} steps now, and the run is in step {}",
                                      recipe.file, now.size(), state.step + 1));
    const auto add = [&](std::size_t k, const Step& expected) {
        for (const std::string& difference : differences(now[k], expected))
            list.push_back(fmt::format("step {} ({}): {}", k + 1, now[k].name, difference));
    };
    for (std::size_t k = 0; k < state.step; ++k) add(k, there[k]);
    add(state.step, revised_as(there[state.step], now[state.step]));
    const double done = state.time - state.step_start, duration = now[state.step].duration;
    if (duration < done * (1.0 - 1e-12))
        list.push_back(fmt::format("step {} ({}): duration = {:.6g} (there {:.6g} are done)", state.step + 1,
                                   now[state.step].name, duration, done));
    if (!list.empty())
        throw RecipeError(fmt::format(
            "{}: cannot change while the run goes on: {}; change flux (but its method), simplify, "
            "advection, values of the step at hand, or later steps",
            recipe.file, fmt::join(list, ", ")));
}

}  // namespace sidewall::app
