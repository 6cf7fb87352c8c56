#pragma once
#include "app/process/arriving/rates.hpp"
#include "app/recipe/recipe.hpp"

// How fast a step may become, from its speeds at the start: for estimates.
namespace sidewall::app {

/// The largest |V| of every material on the wafer, buried ones included, as an etch will reach them. Films of
/// earlier steps, which no time step has grown here, count everywhere, the step's own one where it grows.
/// \returns at least \p at_first.
double fastest_speed(const Model& model, const levelset::MaterialStack& stack, const levelset::Motion& motion,
                     double at_first);

/// The speed that leads to the step's stop condition: of the lowest points if it is a depth, else \p fastest.
double speed_to_stop(const Step& step, const levelset::MaterialStack& stack, const levelset::Motion& motion,
                     double fastest);

}  // namespace sidewall::app
