#pragma once
#include <span>

#include "levelset/layers/stack.hpp"
#include "levelset/motion/advection_options.hpp"
#include "levelset/motion/motion.hpp"

namespace sidewall::levelset {

/// Wall-clock seconds of one time step.
struct AdvectionSeconds {
    double advect = 0.0;      ///< speeds and the Runge-Kutta stages
    double redistance = 0.0;  ///< re-distancing, band and layers
};

/// Moves the surface for \p duration, d(phi)/dt + V |grad phi| = 0, then re-distances it and cuts the other
/// layers. Where V etches into another material within the time step, that material's speed counts for the
/// rest of it. All levels move and then exchange values (exchange_levels). Parallel, deterministic.
///
/// engquist_osher is first order. weno3 and weno5 use Godunov's Hamiltonian. lax_friedrichs is for V(n). On
/// WENO3 differences it takes V at the mean of the one-sided gradients with local dissipation (BeamSpeed), or
/// Godunov's flux of V(n) (other laws). With SpeedLaw::dissipation it takes these bounds on first-order
/// differences, which is monotone and so finds the slow faces of a crystal (Crandall and Lions, Math. Comput.
/// 43 (1984) 1); edges of a crystal's other faces move by Godunov's flux.
///
/// \param motions  V, one for the whole time step or one per Runge-Kutta stage: the first for \p stack, the
///     others for the surfaces that advect_to_stage makes of it.
/// \pre duration * max_speed <= cfl dx, cfl <= 0.5: beyond it the schemes are unstable.
/// \throws NumericsError if a value stops being finite or the surface vanishes.
AdvectionSeconds advect(MaterialStack& stack, std::span<const Motion> motions, double duration,
                        const AdvectionOptions& options);
AdvectionSeconds advect(MaterialStack& stack, const Motion& motion, double duration,
                        const AdvectionOptions& options);

/// Moves the surface to the start of the Runge-Kutta stage after the given ones, to find its speeds there.
/// \param duration  of the whole time step.
/// \pre fewer motions than stages.
void advect_to_stage(MaterialStack& stack, std::span<const Motion> motions, double duration,
                     const AdvectionOptions& options);

}  // namespace sidewall::levelset
