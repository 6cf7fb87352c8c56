#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "app/common/timing.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/motion/advection.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The stop condition that the surface is nearest to.
struct StopDistance {
    double left = kInfinity;  ///< to move; 0 if it holds, infinite if there is none
    const char* key = "";     ///< as recipes call it
};

/// How far the surface may still move before one of the step's stop conditions holds. A condition counts as reached a thousandth of a grid spacing early.
///
/// stop_depth: the lowest point's depth below z = 0. stop_material and a stop at a bare share: what covers the floor that is
/// still to be bared (process/endpoint.hpp). After the endpoint none holds any more. stop_thickness: of the uppermost layer where
/// it is thickest. stop: a figure that is a length changes by no more than twice the way of the front, a depth by as
/// much, a volume by the front's area times it; for how much an angle or a ratio changes there is no bound, and nothing
/// is left of the way only when they are there.
/// \param surface  as extracted from the state's stack.
/// \note O(n log n) for stop_thickness, for stop as the figure takes, else O(n).
StopDistance distance_to_stop(const Recipe& recipe, const Step& step, const RunState& state,
                              const TriangleMesh& surface);

/// A warning if a stop condition holds before the step begins, or can never be met; else empty.
/// \param number   the step's, counted from 1.
/// \param to_stop  from distance_to_stop.
std::string stop_warning(const Recipe& recipe, const Step& step, std::size_t number, double to_stop);

/// A warning if a step has ended by its duration while the wafer had no figure of its `stop`, which could not stop it;
/// else empty.
/// \param surface  as extracted from \p stack.
std::string missing_figure_warning(const Recipe& recipe, const Step& step, std::size_t number,
                                   const levelset::MaterialStack& stack, const TriangleMesh& surface);

/// The motion by the fluxes of the time step's middle, where those of the time step before tell how they change. The
/// first time step of a step does not know it; the second one makes up for what that leaves.
/// \param surface  of the state's stack; fluxes carried over, or with transient coverages, move it as they are.
levelset::Motion motion_in_time_step(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                                     RunState& state);

/// A time step about to be made.
struct TimeStep {
    double dt = 0.0;
    double until = 0.0;  ///< since RunState::epoch; this time step and those like it lead up to it
    double speed = 0.0;  ///< largest |V|, or what stands for it where V depends on the normal
};

/// The number of equal time steps, at least 1, in each of which a front of this speed moves at most cfl grid spacings.
double equal_time_steps(double duration, double speed, double spacing, double cfl);

/// Equal time steps up to the end of the recipe's step or the next surface to save, each moving the front at
/// most cfl grid spacings and at most the share of the step that the model asks for, and none past a stop condition
/// by more than a twentieth of a grid spacing.
/// \param to_stop  how far the front may move before one holds, from distance_to_stop.
/// \throws NumericsError if a speed is not finite, RecipeError if the step would take over 1e7 of them.
TimeStep choose_time_step(const Recipe& recipe, const Step& step, const Model& model, const RunState& state,
                          const levelset::Motion& motion, double to_stop);

/// The recipe's scheme, or the one that the model needs: upwinding takes one speed a point, a speed that turns
/// with the normal needs the schemes of V(n).
levelset::AdvectionOptions scheme_for(const levelset::SpeedLaw& law, levelset::AdvectionOptions options);

/// Moves the surface for a time step.
/// \param motions  one for the whole time step, or one for each Runge-Kutta stage.
/// \throws as levelset::advect.
void advect(const Recipe& recipe, const std::vector<levelset::Motion>& motions, const TimeStep& next,
            levelset::MaterialStack& stack, Timing& timing);

}  // namespace sidewall::app
