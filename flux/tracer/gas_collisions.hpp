#pragma once
#include "flux/tracer/particle_history.hpp"

namespace sidewall::flux {

/// Flies \p rays like fly_block, through a gas. Free paths are exponentially distributed with the species'
/// mean. Each ends in a collision, which gives an isotropic direction, as for a thermal molecule among others
/// of its mass (Bird, Molecular Gas Dynamics (1994), section 1.4), and keeps the weight.
///
/// The random numbers of a flight are keyed by the event and the number of collisions before it. Between
/// collisions a path crosses sides as without a gas; a particle above the source plane has escaped.
/// \returns false if the trace was asked to stop.
bool fly_through_gas(const Trace& trace, Rays& rays, const Event& event, FlightCounts& flights);

}  // namespace sidewall::flux
