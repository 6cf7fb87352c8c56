#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "levelset/layers/stack.hpp"
#include "levelset/motion/advection_options.hpp"
#include "levelset/motion/speed_extension.hpp"

namespace sidewall::levelset {

/// Normal speed V (length per time; positive grows, negative etches) that layer \p layer would have at the
/// extension's sample number \p sample if the surface's unit normal were \p normal. Called in parallel.
using SpeedFunction = std::function<double(std::size_t sample, std::size_t layer, const Vec3& normal)>;

/// The largest etch rate (length per time, 0 where V is nowhere negative) that layer \p layer would have at the
/// extension's sample number \p sample, over all normals. Called in parallel.
using EtchRateFunction = std::function<double(std::size_t sample, std::size_t layer)>;

/// A speed that a parallel beam makes: V(n) = facing max(0, n . d) + always, d the unit vector towards its source.
struct BeamSpeed {
    double facing = 0.0, always = 0.0;  ///< length per time
};

/// The beam's speed that layer \p layer would have at the extension's sample number \p sample. Called in parallel.
using BeamSpeedFunction = std::function<BeamSpeed(std::size_t sample, std::size_t layer)>;

/// What moves the surface in one time step: V and, per sample, what lies below it.
struct Motion {
    Extension extension;
    SpeedFunction speed;
    bool depends_on_normal = false;  ///< V = V(n): evaluated at every node with its own normal
    /// To be set where depends_on_normal: a body that etches at no normal is held in place. Else not asked, as V
    /// itself tells; empty, no body is taken for inert.
    EtchRateFunction max_etch_rate;
    std::vector<float> thickness;  ///< samples x (layers - 1): depth of each lower layer below the sample
                                   ///< (LayerDepths); world
    /// By layer: bounds of |dH/dp| along the axes where V(n), of one sign for all n, makes H = |p| V(p/|p|) no
    /// convex function; else empty.
    std::vector<Vec3> dissipation;
    /// By sample: those of one number have the same V on the same layer, so that it is asked for once. Empty: each
    /// sample has its own.
    std::vector<std::uint8_t> kind;
    std::vector<std::uint8_t> inert;  ///< by layer: V is 0 wherever it is bare. Empty: not known of any
    /// Where V has the form of a BeamSpeed, what saves asking for it at every node; else empty.
    BeamSpeedFunction beam_speed;
    Vec3 beam = Vec3::UnitZ();  ///< d of beam_speed
    /// The same on stack.coarser, with samples of its own; null if there is none.
    std::shared_ptr<const Motion> coarser = nullptr;
};

/// Layer exposed at a sample: the lowest one that (nearly) touches the surface.
std::size_t exposed(const MaterialStack& stack, const Motion& motion, std::size_t sample);

/// Prepares a time step. \p extension as of the stack's surface, \p kind as in Motion.
Motion make_motion(const MaterialStack& stack, Extension extension, SpeedFunction speed,
                   bool depends_on_normal, std::vector<std::uint8_t> kind = {});

/// The largest |V| on the surface, of exposed materials and of those less than a cell below, on all levels where they
/// count.
/// \throws NumericsError if a speed is not finite (the message tells where).
double max_speed(const MaterialStack& stack, const Motion& motion);

/// Wall-clock seconds of one time step.
struct AdvectionSeconds {
    double advect = 0.0;      ///< speeds and the Runge-Kutta stages
    double redistance = 0.0;  ///< re-distancing, band and layers
};

/// Moves the surface for \p duration: d(phi)/dt + V |grad phi| = 0; then re-distances it and cuts the other
/// layers. Where V etches into another material within the time step, the rest of the time counts with that
/// material's speed. All levels move, and give each other their values (exchange_levels). Parallel, deterministic.
///
/// engquist_osher is first order; weno3 and weno5 use Godunov's Hamiltonian; lax_friedrichs takes V(n) at the
/// mean of the one-sided gradients and adds dissipation: local, on WENO3 differences, or by the motion's bounds
/// on first-order ones, which is monotone and so finds the slow faces of a crystal (Crandall and Lions, Math.
/// Comput. 43 (1984) 1).
///
/// \param motions  V, one for the whole time step, or one for each Runge-Kutta stage: the first as of
///                 \p stack, the others as of the surfaces that advect_to_stage makes of it.
/// \pre duration * max_speed <= cfl dx, cfl <= 0.5: beyond it the schemes are unstable.
/// \throws NumericsError if a value stops being finite or the surface vanishes.
AdvectionSeconds advect(MaterialStack& stack, std::span<const Motion> motions, double duration,
                        const AdvectionOptions& options);
AdvectionSeconds advect(MaterialStack& stack, const Motion& motion, double duration,
                        const AdvectionOptions& options);

/// Moves the surface to where the Runge-Kutta stage after the given ones begins, whose speeds are to be found
/// there. \p duration is the whole time step's.
/// \pre fewer motions than stages.
void advect_to_stage(MaterialStack& stack, std::span<const Motion> motions, double duration,
                     const AdvectionOptions& options);

}  // namespace sidewall::levelset
