#pragma once
#include "flux/tracer/particle_history.hpp"

namespace sidewall::flux {

/// Flies \p rays like fly_block, through a gas: free paths are exponentially distributed about the species' mean, and
/// each ends in a collision from which the particle goes on in any direction as likely, like a thermal molecule off
/// others of its mass. Its weight stays. Bird, Molecular Gas Dynamics (1994), section 1.4.
///
/// The random numbers of a flight are named by the event and the collisions before it. Between collisions a path
/// crosses sides as without a gas; one that leads up past the source plane has escaped.
/// \returns false if the trace was asked to stop.
bool fly_through_gas(const Trace& trace, Rays& rays, const Event& event, FlightCounts& flights);

}  // namespace sidewall::flux
