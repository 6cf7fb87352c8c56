#pragma once
#include "app/models/model.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/motion/advection.hpp"

namespace sidewall::app {

/// A time step about to be made.
struct TimeStep {
    double dt = 0.0;
    double until = 0.0;  ///< process time that this time step and those like it lead up to
    double speed = 0.0;  ///< largest |V|, or what stands for it where V depends on the normal
};

/// Equal time steps up to the end of the recipe's step or the next surface to save, each moving the front at
/// most cfl grid spacings and at most the share of the step that the model asks for, and none past a stop condition
/// by more than a twentieth of a grid spacing.
/// \param to_stop  how far the front may move before one holds, from distance_to_stop.
/// \throws NumericsError if a speed is not finite, RecipeError if the step would take over 1e7 of them.
TimeStep choose_time_step(const Recipe& recipe, const Step& step, const Model& model, const RunState& state,
                          const levelset::Motion& motion, double to_stop);

/// The recipe's scheme, or the one that the model needs: upwinding takes one speed a point, a speed that turns
/// with the normal needs Lax-Friedrichs.
levelset::AdvectionOptions scheme_for(const Model& model, levelset::AdvectionOptions options);

}  // namespace sidewall::app
