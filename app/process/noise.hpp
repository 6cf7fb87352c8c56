#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"
#include "app/process/record/run_history.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

// Statistical noise of fluxes, and the noise it causes in the distance that a step moves the surface. Errors
// of time steps are independent, so the mean over N equal ones has an error smaller by the root of N.
namespace sidewall::app {

/// The relative error that fluxes may have in each time step of \p step, to meet [flux] accuracy; none where
/// rays or a relative error are given. The number of time steps is that of an open, flat wafer.
/// \param times  how often the step is repeated.
std::optional<double> noise_of_time_step(const Recipe& recipe, const Step& step, double times);

/// noise_of_time_step for every step of a run, loops unrolled. Repetitions of a step in loops count together.
/// A step that takes no time gets the value of the step before.
/// \note Finds a step's blanket rates once.
std::vector<std::optional<double>> noise_of_time_steps(const Recipe& recipe, const std::vector<Step>& steps);

/// The relative error that fluxes may have in the current time step. The error that earlier time steps of the
/// step have left of the one asked for is shared equally by those to come, as many as take the step to its end
/// at the last dt. The first time step takes the last dt of the same step's repetition before. Without one, and
/// in steps that end by a stop condition, the error is the one foreseen.
/// \param steps     of the run, loops unrolled.
/// \param foreseen_by_step  from noise_of_time_steps.
/// \note Depends on the state alone, so that a resumed run gives the same bits.
std::optional<double> noise_allowed(const Recipe& recipe, const std::vector<Step>& steps,
                                    const std::vector<std::optional<double>>& foreseen_by_step,
                                    const RunState& state);

/// Adds the noise of a traced time step of \p dt to its step's sums.
void add_noise(const TraceReport& trace, double dt, StepNoise& noise);

/// The relative standard error that noise causes in the distance moved by a step and its repetitions, at the
/// worst place: the largest of all \p steps; none if nothing was traced.
std::optional<double> noise_reached(const Recipe& recipe, const std::vector<Step>& steps,
                                    const std::vector<StepEnd>& ends);

}  // namespace sidewall::app
