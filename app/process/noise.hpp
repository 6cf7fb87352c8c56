#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/process/arriving/traced_surface.hpp"
#include "app/process/record/run_history.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

// Statistical noise of fluxes, and what it leaves in what a step moves. The errors of time steps are
// independent, so that their mean over N equal ones is off by a root of N less than each.
namespace sidewall::app {

/// The relative error that fluxes may have in each time step of \p step for [flux] accuracy; none where rays or an
/// error are given. The number of time steps is that of an open, flat wafer.
/// \param times  how often the step is made.
std::optional<double> noise_of_time_step(const Recipe& recipe, const Step& step, double times);

/// Likewise by step of a run, loops unrolled: those of one loop share what is moved, and a step that takes no time has that
/// of the last one before it which does. \note Blanket rates are found once for all passes of a loop.
std::vector<std::optional<double>> noise_of_time_steps(const Recipe& recipe, const std::vector<Step>& steps);

/// The relative error that fluxes may have in the time step at hand: what the step's time steps so far have left of the error allowed,
/// shared by as many like the last one as lead to its end. The first time step is taken to be like those of the same step in the
/// loop's pass before. Where there is none, and in steps that end by a stop condition, it is the error \p foreseen by
/// noise_of_time_steps.
/// \param steps  of the run, loops unrolled.
/// \note From the state alone: a run that goes on from a checkpoint traces as if it had not been interrupted.
std::optional<double> noise_allowed(const Recipe& recipe, const std::vector<Step>& steps,
                                    const std::vector<std::optional<double>>& foreseen,
                                    const RunState& state);

/// Adds the noise of a time step of \p dt to that of its step.
void add_noise(const TraceReport& trace, double dt, StepNoise& noise);

/// The standard error that noise leaves in what \p steps have moved, as a share, where it is largest of those that loops
/// repeat or not; none if nothing was traced.
std::optional<double> noise_reached(const Recipe& recipe, const std::vector<Step>& steps,
                                    const std::vector<StepEnd>& ends);

}  // namespace sidewall::app
