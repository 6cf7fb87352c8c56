#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "flux/history.hpp"

// What neutrals that travel alone and those that share paths have in common at a hit. Internal to the tracer.
namespace sidewall::flux {

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

/// Part of a weight; rounded, which is what the ledger books.
inline std::uint64_t part_of(std::uint64_t weight, std::uint64_t probability) {
    return (weight * probability + kOne / 2) >> 28;
}

/// Sends the particles off from where they landed, a skin above the facet, by Lambert's law about its normal.
/// A facet without area sends them back where they came from.
void scatter_diffusely(const Trace& trace, const Worker& worker, Rays& rays);

/// Long histories must not keep a user waiting who asked to stop.
inline bool abandoned(const Trace& trace, const Event& event) {
    return event.bounce % 256 == 255 && trace.stop();
}

/// Moves the particle of \p row up to \p kept, ready for scatter_diffusely. Not its weight.
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

// Brings what Tally::add will touch into the cache: the indices of a hit far ahead, and the bins that those
// of a nearer one name. A macro, because compilers drop calls of functions that do nothing else.
#define SIDEWALL_PREFETCH_BINS(rays, tally, bins, far_row, near_row)                                         \
    do {                                                                                                     \
        const std::uint32_t far_triangle = (rays).triangle[far_row];                                         \
        __builtin_prefetch((tally).wedges_of(far_triangle));                                                 \
        __builtin_prefetch(&(bins).triangle[far_triangle], 1);                                               \
        const std::uint32_t* near_wedge = (tally).wedges_of((rays).triangle[near_row]);                      \
        for (int corner = 0; corner < 3; ++corner) __builtin_prefetch(&(bins).wedge[near_wedge[corner]], 1); \
    } while (false)

}  // namespace sidewall::flux
