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

/// The stop condition that the surface will meet first.
struct StopDistance {
    double left = kInfinity;  ///< distance that the front may still move; 0: it holds; infinite: none
    const char* key = "";     ///< the condition's key in recipes
};

/// The least distance that the front moves before one of the step's stop conditions holds; none does after
/// the endpoint. A condition, but a bare share, counts as reached a thousandth of a grid spacing early.
///
/// - stop_depth: from the depth of the lowest point below z = 0.
/// - stop_thickness: from the largest thickness of the uppermost layer.
/// - stop_material, or stop at a bare share: from the film left on the floor (process/endpoint.hpp).
/// - stop: a length changes by at most twice the distance that the front moves, a depth by that distance, a
///   volume by it times the front's area. An angle or ratio has no such bound: infinite until reached.
/// \param surface  extracted from the state's stack.
/// \note O(n log n) for stop_thickness; for stop, the cost of its figure; else O(n).
StopDistance distance_to_stop(const Recipe& recipe, const Step& step, const RunState& state,
                              const TriangleMesh& surface);

/// A warning if a stop condition holds before the step begins, or can never hold; else empty.
/// \param number   of the step, from 1.
/// \param to_stop  from distance_to_stop.
std::string stop_warning(const Recipe& recipe, const Step& step, std::size_t number, double to_stop);

/// A warning if a step ended by its duration as the wafer lacked the figure of its `stop`; else empty.
/// \param surface  extracted from \p stack.
std::string missing_figure_warning(const Recipe& recipe, const Step& step, std::size_t number,
                                   const levelset::MaterialStack& stack, const TriangleMesh& surface);

/// The motion of a time step, with fluxes extrapolated to its middle from those of the time step before
/// (with_later_fluxes). A step's first time step does not extrapolate; its second goes twice as far to
/// compensate. Fluxes stay unchanged with [flux] reuse, stages = "all" or transient coverages.
levelset::Motion motion_in_time_step(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                                     RunState& state);

/// A time step about to be made.
struct TimeStep {
    double dt = 0.0;
    double until = 0.0;  ///< since RunState::epoch: end of the equal time steps of which this is the first
    double speed = 0.0;  ///< largest |V|; for V(n) the bound on it that limits the time step
};

/// The number (at least 1) of equal time steps in which a front of this speed moves at most cfl cells each.
double equal_time_steps(double duration, double speed, double spacing, double cfl);

/// The next of equal time steps up to the end of the recipe's step or the next surface to save. Each moves
/// the front by at most cfl grid spacings, takes at most the share of the step that the model asks for, and
/// passes a stop condition by at most a twentieth of a grid spacing.
/// \param to_stop  from distance_to_stop.
/// \throws NumericsError if a speed is not finite, RecipeError if the step would take over 1e7 time steps.
TimeStep choose_time_step(const Recipe& recipe, const Step& step, const Model& model, const RunState& state,
                          const levelset::Motion& motion, double to_stop);

/// The recipe's scheme, or Lax-Friedrichs for a speed V(n): upwinding needs one speed a point.
levelset::AdvectionOptions scheme_for(const levelset::SpeedLaw& law, levelset::AdvectionOptions options);

/// Moves the surface for a time step.
/// \param motions  one for the whole time step, or one for each Runge-Kutta stage.
/// \throws as levelset::advect.
void advect(const Recipe& recipe, const std::vector<levelset::Motion>& motions, const TimeStep& next,
            levelset::MaterialStack& stack, Timing& timing);

}  // namespace sidewall::app
