#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/tracer/particle_history.hpp"

// Surface hits of neutrals, and what they have in common with those of ions. Internal to the tracer.
namespace sidewall::flux {

/// Lists the rows of the rays that hit something. \returns how many.
std::size_t list_hits(const Rays& rays, Column<std::uint32_t>& hits);

/// Books the weight of a bundle that escaped or leaked, and counts its arrivals.
void book_misses(const Rays& rays, Bundle& bundle);

/// The hits of one bounce of neutrals that do nothing but stick or get re-emitted diffusely: tallies and absorbs them;
/// survivors of roulette move up in \p rays, ready to fly on.
void react_neutrals(const Trace& trace, Bundle& bundle, Worker& worker, Rays& rays, const Event& event);

/// The hits of one bounce of paths that several species share.
///
/// A path carries a weight of every species. At a hit each is tallied and absorbed by its own sticking, and
/// the path goes on with what is left of them. Roulette is played by the path, on the largest: the path ends,
/// or goes on with all its weights multiplied so that the largest becomes kOne. A species whose weight is
/// small by then plays on its own for a sixteenth. That keeps every species' mean; rounding to the nearest
/// weight, which the ledgers book, moves one by at most 2^-29 a hit. A history of a species ends when its
/// weight does or when the path ends, whichever comes first; lost at roulette counts as absorbed, as
/// everywhere.
///
/// Survivors move up in worker.rays, ready to fly on.
/// \param bundles  one a species, over worker.rays.
/// \pre the species have the same_paths.
void react_shared(const Trace& trace, std::span<Bundle> bundles, Worker& worker, const Event& event);

/// The hits of one bounce of any particles, in double precision: tallies them and their yields, reflects or
/// re-emits what is not absorbed, less the energy it loses. Survivors of roulette move up in worker.rays, ready to
/// fly on; sputtered particles go to worker.secondaries, likewise.
/// \param tallies  in the order of tally_names.
void react_ions(const Trace& trace, Bundle& bundle, Worker& worker, const Event& event,
                const std::vector<Tally>& tallies);

}  // namespace sidewall::flux
