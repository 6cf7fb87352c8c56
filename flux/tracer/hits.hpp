#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "flux/tracer/particle_history.hpp"

// What all kinds of particles have in common at a hit. Internal to the tracer.
namespace sidewall::flux {

/// The particles of one species in a block, or of what its hits sputter: their weights, what they stick to,
/// and where they are booked. Species that share paths have a bundle each over the same rays.
struct Bundle {
    std::size_t species;    ///< of the pass
    std::uint64_t* weight;  ///< by row of the rays, 2^-28 particles
    const Sticking* sticking;
    const Tally* tally;
    Tally::Bins* bins;
    Ledger* ledger;
    Counts* counts;              ///< null for what hits sputter, which is no history of its own
    std::uint64_t arrived = 0;   ///< hits of this bounce with any of its weight
    std::uint64_t survived = 0;  ///< those of them that go on with any of it
};

/// Flies \p rays on to where they hit or leave, as the event's next bounce.
/// \returns false if the block is done: no ray is left, the caller of the trace asked to stop, or the rays have
///          bounced max_bounces times, which ends them as leaked.
bool fly_on(const Trace& trace, std::span<Bundle> bundles, Rays& rays, Event& event, FlightCounts& flights);

/// Lists the rows of the rays that hit something. \returns how many.
std::size_t list_hits(const Rays& rays, Column<std::uint32_t>& hits);

/// Books the weight of a bundle that escaped or leaked, and counts its arrivals.
void book_misses(const Rays& rays, Bundle& bundle);

/// Sends the particles off from where they hit, a skin above the facet, by Lambert's law about its normal.
/// A facet without area sends them back where they came from.
void reemit_diffusely(const Trace& trace, const Worker& worker, Rays& rays);

/// Sticking probability times kOne at a hit.
inline std::uint64_t sticking_at(const Trace& trace, const Sticking& sticking, std::uint32_t triangle,
                                 float u, float v) {
    if (sticking.by_wedge.empty())
        return sticking.by_triangle[sticking.by_triangle.size() == 1 ? 0 : triangle];
    const std::uint32_t* corner = &trace.wedges.corner[3 * std::size_t{triangle}];
    const float s = (1.0f - u - v) * sticking.by_wedge[corner[0]] + u * sticking.by_wedge[corner[1]] +
                    v * sticking.by_wedge[corner[2]];
    return static_cast<std::uint64_t>(std::clamp(s, 0.0f, 1.0f) * static_cast<float>(kOne));
}

/// Part of a weight, of any number of particles; rounded, which is what the ledger books.
inline std::uint64_t part_of(std::uint64_t weight, std::uint64_t probability) {
    return (weight >> 28) * probability + (((weight & (kOne - 1)) * probability + kOne / 2) >> 28);
}

/// The weight goes on as it is, or plays for a whole one with 28 random bits. \returns 0 if it lost.
inline std::uint64_t play_roulette(std::uint64_t weight, std::uint64_t threshold, std::uint32_t word,
                                   Ledger& ledger) {
    const bool safe = weight >= threshold, wins = (word >> 4) < weight;
    ledger.gained += !safe & wins ? kOne - weight : 0;
    ledger.lost += !safe & !wins ? weight : 0;
    return safe ? weight : wins ? kOne : 0;
}

/// Calls use(k, words, lane) for the hits k = 0, 1, ... of \p count, whose four random words of the event are
/// words[0..3][lane].
template <class Use>
inline void for_each_hit(const Trace& trace, const Rays& rays, Column<std::uint32_t>& hits, std::size_t count,
                         const Event& event, const Use& use) {
    std::fill_n(hits.begin() + static_cast<std::ptrdiff_t>(count), kLanes, 0);
    alignas(32) std::uint32_t numbers[kLanes], words[4][kLanes];
    for (std::size_t first = 0; first < count; first += kLanes) {
        for (std::size_t i = 0; i < kLanes; ++i) numbers[i] = rays.ray[hits[first + i]];
        draw8(trace.key, numbers, event, words);
        const std::size_t lanes = std::min(kLanes, count - first);
        for (std::size_t i = 0; i < lanes; ++i) use(first + i, words, i);
    }
}

/// Moves the particle of \p row up to \p kept, ready for reemit_diffusely. Not its weight.
inline void move_up(Worker& w, Rays& r, std::size_t kept, std::size_t row, std::uint32_t word1,
                    std::uint32_t word2) {
    r.x[kept] = r.x[row];
    r.y[kept] = r.y[row];
    r.z[kept] = r.z[row];
    r.dx[kept] = r.dx[row];
    r.dy[kept] = r.dy[row];
    r.dz[kept] = r.dz[row];
    r.nx[kept] = r.nx[row];
    r.ny[kept] = r.ny[row];
    r.nz[kept] = r.nz[row];
    r.distance[kept] = r.distance[row];
    r.ray[kept] = r.ray[row];
    r.from[kept] = r.triangle[row];
    w.word1[kept] = word1;
    w.word2[kept] = word2;
}

// Brings what Tally::add will touch into the cache: the indices of a hit far ahead of the k-th of `count`,
// and the bins that those of a nearer one name. A macro, because compilers drop calls of functions that do
// nothing else.
#define SIDEWALL_PREFETCH_BINS(rays, bundle, hits, k, count)                                       \
    do {                                                                                           \
        const std::uint32_t far_triangle = (rays).triangle[(hits)[std::min((k) + 24, (count)-1)]]; \
        const std::uint32_t near_triangle = (rays).triangle[(hits)[std::min((k) + 8, (count)-1)]]; \
        __builtin_prefetch((bundle).tally->wedges_of(far_triangle));                               \
        __builtin_prefetch(&(bundle).bins->triangle[far_triangle], 1);                             \
        const std::uint32_t* near_wedge = (bundle).tally->wedges_of(near_triangle);                \
        for (int corner = 0; corner < 3; ++corner)                                                 \
            __builtin_prefetch(&(bundle).bins->wedge[near_wedge[corner]], 1);                      \
    } while (false)

}  // namespace sidewall::flux
