#include "app/process/revision.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <tuple>

#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/steps.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Whether a revision may change this key. It may not change flux.method, which is chosen as a step begins.
bool may_change(const std::string& difference) {
    const auto of = [&](const char* section) { return difference.starts_with(section); };
    return (of("flux.") && !of("flux.method")) || of("simplify.") || of("advection.");
}

// The step with the duration and the stop conditions of \p other.
Step as_long_as(Step step, const Step& other) {
    std::tie(step.duration, step.stop_depth, step.stop_thickness, step.stop, step.over_etch,
             step.over_etch_time) = std::tie(other.duration, other.stop_depth, other.stop_thickness,
                                             other.stop, other.over_etch, other.over_etch_time);
    return step;
}

// The step with all that a revision may take from \p other: as_long_as, the material to stop at and the
// model's values, but not the film that it deposits.
Step revised_as(Step step, const Step& other) {
    step = as_long_as(std::move(step), other);
    step.stop_material = other.stop_material;
    if (step.model != other.model) return step;
    Step revised = step;
    revised.parameters = other.parameters;
    if (auto* film = target_of<std::string>(keys_of(revised), "deposit"))
        *film = *target_of<std::string>(keys_of(step), "deposit");
    return revised;
}

void refuse_differences(const std::string& where, const std::vector<std::string>& list) {
    if (list.empty()) return;
    constexpr std::size_t kMost = 5;
    std::vector<std::string> shown(list.begin(), list.begin() + std::min(kMost, list.size()));
    if (list.size() > kMost) shown.push_back(fmt::format("{} more", list.size() - kMost));
    throw FileError("the recipes differ in {}{}", where, fmt::join(shown, ", "));
}

bool comes_earlier(const std::optional<double>& now, const std::optional<double>& there) {
    return now && (!there || *now < *there);
}

// Whether the stop condition of \p now is met before that of \p there, or cannot be compared with it.
bool stops_earlier(const Recipe& recipe, const Step& now, const Step& there) {
    const std::string &text = now.stop, &before = there.stop;
    if (text == before || text.empty()) return false;
    if (before.empty()) return true;
    const StopRule rule = stop_rule(recipe, text), other = stop_rule(recipe, before);
    if (rule.figure != other.figure || rule.above != other.above) return true;
    return rule.above ? rule.value < other.value : rule.value > other.value;
}

// Refuses a step that ends before \p there does. \p done: time that it has taken, to within \p rounding.
void refuse_shorter(const std::string& where, const Recipe& recipe, const Step& now, const Step& there,
                    double done, double rounding) {
    std::vector<std::string> shorter;
    if (now.duration < done * (1.0 - 1e-12) - rounding)
        shorter.push_back(fmt::format("duration = {:.6g} (there {:.6g} are done)", now.duration, done));
    if (comes_earlier(now.stop_depth, there.stop_depth)) shorter.emplace_back("an earlier stop_depth");
    if (comes_earlier(now.stop_thickness, there.stop_thickness))
        shorter.emplace_back("an earlier stop_thickness");
    if (stops_earlier(recipe, now, there)) shorter.emplace_back("an earlier stop, or one at another figure");
    if (now.over_etch < there.over_etch) shorter.emplace_back("a shorter over_etch");
    if (now.over_etch_time < there.over_etch_time) shorter.emplace_back("a shorter over_etch_time");
    refuse_differences(where, shorter);
}

// Rethrows the current exception with a line appended, if it is one of Kinds.
template <class... Kinds>
void throw_one_of_with(const std::string& line) {
    const auto attempt = [&](auto* kind) {
        using Kind = std::remove_pointer_t<decltype(kind)>;
        try {
            throw;
        } catch (const Kind& error) {
            throw Kind(fmt::format("{}\n{}", error.what(), line));
        } catch (...) {
        }
    };
    (attempt(static_cast<Kinds*>(nullptr)), ...);
}

}  // namespace

bool same_stop_conditions(const Step& a, const Step& b) {
    return std::tie(a.stop, a.stop_depth, a.stop_thickness, a.stop_material) ==
           std::tie(b.stop, b.stop_depth, b.stop_thickness, b.stop_material);
}

void require_revision(const Recipe& recipe, const Recipe& began_with, const RunState& state) {
    std::vector<std::string> list = differences(recipe, began_with);
    std::erase_if(list, may_change);
    const std::vector<Step> now = expanded_steps(recipe), there = expanded_steps(began_with);
    if (now.size() <= state.step)
        throw RecipeError("{}: the recipe has {} steps now, and the run is in step {}", recipe.file,
                          now.size(), state.step + 1);
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
        throw RecipeError(
            "{}: cannot change while the run goes on: {}; change flux (but its method), simplify, "
            "advection, values of the step at hand, or later steps",
            recipe.file, fmt::join(list, ", "));
}

void extend(RunState& state, const Recipe& recipe, const Recipe& began_with) {
    refuse_differences("", differences(recipe, began_with));
    const std::vector<Step> now = expanded_steps(recipe), there = expanded_steps(began_with);
    const bool finished = state.step >= there.size();
    const std::size_t last = finished ? there.size() - 1 : state.step;
    if (now.size() <= last)
        throw FileError("this recipe has {} steps, and the run there is in step {}", now.size(), last + 1);
    for (std::size_t k = 0; k < last; ++k)
        refuse_differences(fmt::format("step {} ({}): ", k + 1, now[k].name), differences(now[k], there[k]));
    const std::string where = fmt::format("step {} ({}): ", last + 1, now[last].name);
    refuse_differences(where, differences(as_long_as(now[last], there[last]), there[last]));
    const double rounding = 4.0 * std::numeric_limits<double>::epsilon() * state.process_time();
    refuse_shorter(where, recipe, now[last], there[last], state.since(state.starts[last]), rounding);
    const bool longer = !differences(now[last], there[last]).empty();
    if (!same_stop_conditions(now[last], there[last])) {
        if (state.endpoint.time && state.time > *state.endpoint.time)
            refuse_differences(where, {"another stop condition (there the over-etch has begun)"});
        state.endpoint.time.reset();  // the later condition is still to come
    }
    if (!finished || !longer) return;
    state.end_row.clear();
    state.step = last;
    // The start is known up to rounding only, and must not be later than the time.
    state.step_start =
        state.time_steps[last] == 0 ? state.time : std::min(state.time, state.starts[last] - state.epoch);
    state.starts.resize(last + 1);
    state.time_steps.resize(last + 1);
}

void rethrow_with_undo_advice(const std::filesystem::path& folder, std::filesystem::file_time_type before) {
    std::error_code failure;
    const bool untouched = std::filesystem::last_write_time(folder / "checkpoint.vdb", failure) == before;
    throw_one_of_with<IoError, NumericsError, GeometryError, FileError, RecipeError>(
        fmt::format("{}: the extension of the finished run there failed: {}", folder.string(),
                    untouched ? "its checkpoint is as it was: --resume with the recipe as it was makes "
                                "the finished run's files again"
                              : "its checkpoint is of a later time: only this recipe or a longer one goes "
                                "on from there, with --resume"));
}

}  // namespace sidewall::app
