#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "flux/random.hpp"
#include "flux/source.hpp"
#include "flux/species.hpp"
#include "flux/tracer/flight.hpp"
#include "flux/tracer/packets.hpp"
#include "flux/tracer/tally.hpp"
#include "flux/tracer/tracer.hpp"
#include "flux/wedges.hpp"

// The data that particle histories read and write. Internal to the tracer.
namespace sidewall::flux {

/// Sticking probabilities of a species.
struct Sticking {
    std::vector<std::uint32_t> by_triangle;  ///< in units of 1 / kOne; a single value holds for all
    std::vector<float> by_wedge;             ///< as probabilities; replaces by_triangle unless empty
};

/// Everything that a particle history reads. Shared by all threads.
struct Trace {
    Geometry geometry;
    const Species& species;  ///< the first of the pass; it determines source and reflection of all paths
    const Wedges& wedges;
    RandomKey key;
    std::vector<Sticking> sticking;   ///< by species of the pass
    std::vector<std::size_t> active;  ///< species of the pass that still need paths, ascending; never empty
    Sticking redeposition;
    SurfaceSource desorption;                 ///< emission from the surface; only with a single species
    std::span<const std::int32_t> materials;  ///< by triangle, or empty
    std::uint64_t roulette = kOne;            ///< weights below it play Russian roulette
    std::uint32_t max_bounces = 0;
    /// Index of the first of the tallies for hits after a particle's first; 0: there are none.
    std::size_t reflected = 0;
    bool adjoint = false;        ///< first arrivals are sampled from the surface, see adjoint.hpp
    std::function<bool()> stop;  ///< asked from time to time; true abandons the block
};

/// Counts of the particles of all species of a pass, and of their flights.
struct PassCounts {
    std::vector<Counts> species;
    FlightCounts flights;
    void add(PassCounts other);
    /// Appends all counts to \p words, in a fixed order.
    void write(std::vector<std::uint64_t>& words);
    /// Reads all counts, as write() made them for as many species, and drops them from the front of \p words.
    void read(std::span<std::uint64_t>& words);

  private:
    // Counts and FlightCounts consist of 64-bit words only.
    template <class Use>
    void each_word(const Use& use) {
        const auto of = [&](auto& counts) {
            auto* words = reinterpret_cast<std::uint64_t*>(&counts);
            std::for_each_n(words, sizeof counts / sizeof *words, use);
        };
        std::for_each(species.begin(), species.end(), of);
        of(flights);
    }
};

/// The data of one thread: buffers, its bins of every tally, and the counts of the batch in progress.
struct Worker {
    Rays rays, secondaries;              ///< particles in flight; those sputtered by the hits of a bounce
    Column<std::uint32_t> hits;          ///< rows of the rays that hit the surface
    Column<std::uint32_t> word1, word2;  ///< random words for the directions of survivors
    std::vector<Column<std::uint64_t>> weights;  ///< weights by species if several share paths
    std::vector<Tally::Bins*> bins;              ///< one for each tally
    std::vector<Counts> counts;                  ///< by species of the pass
    FlightCounts flights;                        ///< of the pass
};

/// The particles of one species in a block, or those that its hits sputter: weights, sticking, and where they
/// are tallied and counted. Species that share paths have a bundle each over the same rays.
struct Bundle {
    std::size_t species;    ///< index in the pass
    std::uint64_t* weight;  ///< by row of the rays, in units of 1 / kOne
    const Sticking* sticking;
    const Tally* tally;
    Tally::Bins* bins;
    Ledger* ledger;
    Counts* counts;              ///< null for sputtered particles, which do not count as histories
    std::uint64_t arrived = 0;   ///< hits of this bounce with weight above 0
    std::uint64_t survived = 0;  ///< those of them that continue with weight above 0
};

/// Sticking probability at a hit, in units of 1 / kOne.
inline std::uint64_t sticking_at(const Trace& trace, const Sticking& sticking, std::uint32_t triangle,
                                 float u, float v) {
    if (sticking.by_wedge.empty())
        return sticking.by_triangle[sticking.by_triangle.size() == 1 ? 0 : triangle];
    const std::uint32_t* corner = &trace.wedges.corner[3 * std::size_t{triangle}];
    const float s = (1.0f - u - v) * sticking.by_wedge[corner[0]] + u * sticking.by_wedge[corner[1]] +
                    v * sticking.by_wedge[corner[2]];
    return static_cast<std::uint64_t>(std::clamp(s, 0.0f, 1.0f) * static_cast<float>(kOne));
}

/// \p weight, which may exceed kOne, times a probability in units of 1 / kOne; rounded, without overflow.
inline std::uint64_t part_of(std::uint64_t weight, std::uint64_t probability) {
    return (weight >> 28) * probability + (((weight & (kOne - 1)) * probability + kOne / 2) >> 28);
}

/// Russian roulette by 28 random bits: a weight w below the threshold becomes kOne at probability w / kOne,
/// else 0.
inline std::uint64_t play_roulette(std::uint64_t weight, std::uint64_t threshold, std::uint32_t word,
                                   Ledger& ledger) {
    const bool safe = weight >= threshold, wins = (word >> 4) < weight;
    ledger.gained += !safe & wins ? kOne - weight : 0;
    ledger.lost += !safe & !wins ? weight : 0;
    return safe ? weight : wins ? kOne : 0;
}

/// Traces particles [first, first + count) of a batch to their ends. Deterministic, whatever the worker did
/// before.
/// \param tallies  in the order of tally_names; if several species share paths, one for each of them.
/// \pre count <= kBlock.
void trace_block(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                 const std::vector<Tally>& tallies, Worker& worker);

}  // namespace sidewall::flux
