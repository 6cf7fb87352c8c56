#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "flux/history.hpp"

namespace sidewall::flux {

/// A species whose paths go on without others.
struct Left {
    std::size_t species;
    Event event;  ///< of the last hit
};

/// Traces the block that emit() has put into worker.rays for all species of trace.riding at once.
///
/// A path carries a weight of every species. At a hit each is tallied and absorbed by its own sticking, and
/// the path goes on with what is left of them. Roulette is played by the path, on the largest: the path ends,
/// or goes on with all its weights multiplied so that the largest becomes kOne. A species whose weight is
/// small by then plays on its own for a sixteenth. That keeps every species' mean; rounding to the nearest
/// weight, which the ledgers book, moves one by at most 2^-29 a hit. A history of a species ends when its
/// weight does or when the path ends, whichever comes first; lost at roulette counts as absorbed, as
/// everywhere.
///
/// \pre they have the same_paths.
/// \param tallies  one a species of the pass.
/// \returns when all others have stuck, the one left: its weights are in worker.rays, and the caller follows
///          it on from the event, which is faster. Nothing if all paths have ended.
std::optional<Left> follow_together(const Trace& trace, const Batch& batch, const std::vector<Tally>& tallies,
                                    Worker& worker);

}  // namespace sidewall::flux
