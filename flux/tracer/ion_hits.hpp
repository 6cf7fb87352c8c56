#pragma once
#include <vector>

#include "flux/tracer/particle_history.hpp"

namespace sidewall::flux {

/// The hits of one bounce of any particles, in double precision: tallies them and their yields, reflects or
/// re-emits what is not absorbed, less the energy it loses. Survivors of roulette move up in worker.rays, ready to
/// fly on; sputtered particles go to worker.secondaries, likewise.
/// \param tallies  in the order of tally_names.
void react_ions(const Trace& trace, Bundle& bundle, Worker& worker, const Event& event,
                const std::vector<Tally>& tallies);

}  // namespace sidewall::flux
