#include "app/process/noise.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/process/endpoint.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/recipe.hpp"

using namespace sidewall;
using namespace sidewall::app;

TEST_CASE(
    "the noise of a time step is the largest of its species, arriving or redeposited, without that of linear elements") {
    TraceReport trace;
    trace.species.resize(3);
    trace.species[0].relative_error = 0.01;
    trace.species[1].relative_error = std::hypot(0.02, 0.5);
    trace.species[1].discretisation_error = 0.5;
    StepNoise noise;
    add_noise(trace, 1.0, noise);
    CHECK(std::sqrt(noise.squares) == Approx(0.02));
    trace.species[2].redeposition_error = 0.06;
    add_noise(trace, 2.0, noise);
    CHECK(noise.squares == Approx(0.02 * 0.02 + 0.12 * 0.12));
    CHECK(noise.time == 3.0);
}

TEST_CASE(
    "the noise allowed in a time step leaves the step with the accuracy asked for, however long its time steps are") {
    const Recipe recipe = load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/trench_profile.toml",
                                      {"flux.rays=0", "flux.accuracy=0.01"});
    const std::vector<Step> steps = expanded_steps(recipe);
    const auto foreseen = noise_of_time_steps(recipe, steps);
    // More time steps than foreseen on an open wafer; fewer; and those of a front that slows down, the last
    // of which are longer than foreseen.
    for (const auto& dt :
         {std::vector(20, 0.1), std::vector(10, 0.2), std::vector{0.1, 0.1, 0.2, 0.2, 0.4, 0.4, 0.6}}) {
        RunState state = initial_state(recipe);
        for (const double own : dt) {
            TraceReport trace;
            trace.species.resize(1);
            trace.species[0].relative_error = *noise_allowed(recipe, steps, foreseen, state);
            add_noise(trace, own, state.noise);
            state.advance(own, step_end(steps[0], state));
        }
        state.history.ends.push_back({.noise = state.noise});
        CHECK(*noise_reached(recipe, steps, state.history.ends) == Approx(0.01).epsilon(0.07));
    }
}

TEST_CASE("a step with a stop condition, or without a time step yet, gets the noise that was foreseen") {
    const auto allowed = [](const std::vector<std::string>& overrides, double dt) {
        const Recipe recipe =
            load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/trench_profile.toml", overrides);
        RunState state = initial_state(recipe);
        state.noise.dt = dt;
        return *noise_allowed(recipe, expanded_steps(recipe), {0.025}, state);
    };
    CHECK(allowed({"flux.rays=0"}, 0.0) == 0.025);
    CHECK(allowed({"flux.rays=0"}, 0.01) != 0.025);
    CHECK(allowed({"flux.rays=0", "step[0].stop_depth=1"}, 0.01) == 0.025);
}
