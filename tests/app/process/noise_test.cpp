#include "app/process/noise.hpp"

#include <catch2/catch.hpp>
#include <cmath>

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
