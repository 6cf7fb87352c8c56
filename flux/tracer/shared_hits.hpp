#pragma once
#include <span>

#include "flux/tracer/hits.hpp"

namespace sidewall::flux {

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
void hit_shared(const Trace& trace, std::span<Bundle> bundles, Worker& worker, const Event& event);

}  // namespace sidewall::flux
