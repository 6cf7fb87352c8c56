#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/tracer/particle_history.hpp"

// Surface hits of neutrals and ions: tally, absorption, roulette, re-emission. Internal to the tracer.
namespace sidewall::flux {

/// Lists the rows of the rays that hit the surface. \returns their number.
std::size_t list_hits(const Rays& rays, Column<std::uint32_t>& hits);

/// Books the weight of a bundle's particles that escaped or leaked, and counts those that arrived.
void book_misses(const Rays& rays, Bundle& bundle);

/// Processes one bounce of neutrals that only stick or are re-emitted diffusely: tallies hits and absorbs
/// weight. Survivors of roulette move up to the first rows of \p rays, ready for their next flight.
void react_neutrals(const Trace& trace, Bundle& bundle, Worker& worker, Rays& rays, const Event& event);

/// Processes one bounce of paths that several species share.
///
/// A path carries one weight for each species. At a hit each weight is tallied and reduced by its species'
/// sticking. If its largest weight is below the threshold, the path plays roulette: it ends, or continues
/// with all weights scaled so that the largest becomes kOne. A species whose weight is then below kOne / 16
/// (or the threshold, if that is less) plays alone, for that weight. Every species' mean is kept. Rounding
/// changes a weight by at most 2^-29 of a particle a hit, which the ledgers book. A species' history ends
/// when its weight becomes 0 or the path ends; a loss at roulette counts as absorbed.
///
/// Survivors move up to the first rows of worker.rays, ready for their next flight.
/// \param bundles  one for each species, over worker.rays.
/// \pre the species have the same_paths.
void react_shared(const Trace& trace, std::span<Bundle> bundles, Worker& worker, const Event& event);

/// Processes one bounce of any particles, in double precision: tallies hits and yields, then reflects or
/// re-emits, with reduced energy, the weight that is not absorbed. Survivors of roulette move up to the first
/// rows of worker.rays, ready for their next flight; sputtered particles go to worker.secondaries.
/// \param tallies  in the order of tally_names.
void react_ions(const Trace& trace, Bundle& bundle, Worker& worker, const Event& event,
                const std::vector<Tally>& tallies);

}  // namespace sidewall::flux
