#include "app/process/noise.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "app/process/endpoint.hpp"
#include "app/process/estimate/blanket.hpp"
#include "app/process/time_step.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/step_materials.hpp"

namespace sidewall::app {
namespace {

// Ratio of the standard error of the moved distance at the worst place to the mean relative error of fluxes
// at vertices. It rises where little arrives, and falls as a front averages over its neighbourhood (in a
// profile only over a line). Between seeds of quick recipes, depths and films scattered by up to this ratio;
// in profiles, thin films by up to 1.5 times as much, films closing an opening 2.4 times, widths at a
// depth 3 times.
double at_worst_place(const Recipe& recipe) {
    return is_plane_profile(recipe.domain) ? 2.0 : 1.3;
}
// Largest noise allowed. Models are not linear, so more noise would bias their results: at 0.08 the polymer
// of a Bosch hole opened where noise had thinned it.
constexpr double kLargest = 0.05;

// Largest distance that an open wafer moves in the step.
double way_of(const Recipe& recipe, const Step& step) {
    double way = fastest_blanket(recipe, step) * step.duration;
    if (step.stop_depth) way = std::min(way, *step.stop_depth);
    if (step.stop_thickness) way = std::min(way, *step.stop_thickness);
    return way;
}

}  // namespace

std::optional<double> noise_of_time_step(const Recipe& recipe, const Step& step, double times) {
    if (!recipe.flux.by_accuracy() || !step.built || step.built->species.empty()) return {};
    const double count = std::max(
        static_cast<double>(step.built->min_time_steps),
        equal_time_steps(1.0, way_of(recipe, step), domain_of(recipe).spacing, recipe.advection.cfl));
    return std::min(kLargest, recipe.flux.accuracy * std::sqrt(count * times) / at_worst_place(recipe));
}

std::vector<std::optional<double>> noise_of_time_steps(const Recipe& recipe, const std::vector<Step>& steps) {
    std::map<const Model*, double> times;
    for (const Step& step : steps) times[step.built.get()] += 1.0;
    std::map<const Model*, std::optional<double>> known;
    std::vector<std::optional<double>> noise;
    for (const Step& step : steps) {
        const Model* model = step.built.get();
        if (model == nullptr)
            noise.push_back(noise.empty() ? std::nullopt : noise.back());
        else if (const auto found = known.find(model); found != known.end())
            noise.push_back(found->second);
        else
            noise.push_back(known[model] = noise_of_time_step(recipe, step, times[model]));
    }
    return noise;
}

std::optional<double> noise_allowed(const Recipe& recipe, const std::vector<Step>& steps,
                                    const std::vector<std::optional<double>>& foreseen_by_step,
                                    const RunState& state) {
    if (foreseen_by_step.empty()) return {};
    const std::optional<double> foreseen =
        foreseen_by_step[std::min(state.step, foreseen_by_step.size() - 1)];
    if (!foreseen || state.step >= steps.size()) return foreseen;
    const Step& step = steps[state.step];
    StepNoise known = state.noise;
    for (std::size_t k = std::min(state.step, state.history.ends.size()); k-- > 0 && known.dt == 0.0;)
        if (steps[k].built == step.built) known.dt = state.history.ends[k].noise.dt;
    const double left = step_end(step, state) - state.time, whole = known.time + left;
    if (has_stop(step) || !(known.dt > 0.0 && left > 0.0)) return foreseen;
    const auto passes = static_cast<double>(std::ranges::count(steps, step.built, &Step::built));
    const double share = recipe.flux.accuracy / at_worst_place(recipe),
                 equal = share * std::sqrt(passes * whole / known.dt),
                 squares_left = passes * share * share * whole * whole - known.squares;
    // Traces that were noisier than asked for are not made up for at any price.
    constexpr double kLeastShare = 0.7;
    const double rest = std::sqrt(std::max(0.0, squares_left) / (known.dt * left));
    return std::min(kLargest, std::max(rest, kLeastShare * equal));
}

void add_noise(const TraceReport& trace, double dt, StepNoise& noise) {
    double worst = 0.0;
    for (const flux::FluxResult& flux : trace.species) {
        const double elements = flux.discretisation_error, all = flux.relative_error;
        constexpr double kRounding = 1e-12;
        const double rays = all * all - elements * elements;
        if (std::isfinite(all) && rays > kRounding * all * all) worst = std::max(worst, std::sqrt(rays));
        worst = std::max(worst, flux.redeposition_error);
    }
    noise.squares += std::pow(worst * dt, 2.0);
    noise.time += dt;
    noise.dt = dt;
}

std::optional<double> noise_reached(const Recipe& recipe, const std::vector<Step>& steps,
                                    const std::vector<StepEnd>& ends) {
    std::map<const Model*, StepNoise> by_step;
    for (std::size_t k = 0; k < std::min(steps.size(), ends.size()); ++k) {
        StepNoise& sum = by_step[steps[k].built.get()];
        sum.squares += ends[k].noise.squares;
        sum.time += ends[k].noise.time;
    }
    std::optional<double> worst;
    for (const auto& [model, sum] : by_step)
        if (sum.time > 0.0)
            worst = std::max(worst.value_or(0.0), at_worst_place(recipe) * std::sqrt(sum.squares) / sum.time);
    return worst;
}

}  // namespace sidewall::app
