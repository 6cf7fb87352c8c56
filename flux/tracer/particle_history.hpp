#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "flux/random.hpp"
#include "flux/rays.hpp"
#include "flux/source.hpp"
#include "flux/species.hpp"
#include "flux/tracer/cut_corners.hpp"
#include "flux/tracer/flight.hpp"
#include "flux/tracer/packets.hpp"
#include "flux/tracer/tally.hpp"
#include "flux/tracer/tracer.hpp"
#include "flux/wedges.hpp"
#include "flux/weight.hpp"

// What particle histories read and write. Internal to the tracer; history.cpp tells a particle's life.
namespace sidewall::flux {

/// Sticking probabilities.
struct Sticking {
    std::vector<std::uint32_t> by_triangle;  ///< in units of 1 / kOne, or a single one for all
    std::vector<float> by_wedge;             ///< as probabilities; replaces the others unless empty
};

/// Everything a history reads. Shared by all threads.
struct Trace {
    Geometry geometry;
    const Species& species;  ///< the first of the pass: where paths begin and how they go on
    const Wedges& wedges;
    RandomKey key;
    std::vector<Sticking> sticking;   ///< by species of the pass
    std::vector<std::size_t> active;  ///< species of the pass that still need paths, ascending; never empty
    Sticking redeposition;
    SurfaceSource desorption;                 ///< of the species, which then is alone
    std::span<const std::int32_t> materials;  ///< by triangle, or empty
    CutCorners cut_corners;                   ///< where yields are those of the faces
    std::uint64_t roulette = kOne;            ///< weights below it play Russian roulette
    std::uint32_t max_bounces = 0;
    bool bottom_up = false;      ///< first arrivals are looked for from the surface, see looks.hpp
    std::function<bool()> stop;  ///< asked now and then; true abandons the block
};

/// What became of a species' particles, summed.
struct Counts {
    std::uint64_t emitted = 0, absorbed = 0, escaped = 0, leaked = 0, arrivals = 0;
    Ledger ledger, redeposited;
    void add(const Counts& other);
};

/// The same of all species of a pass, and their flights.
struct PassCounts {
    std::vector<Counts> species;
    FlightCounts flights;
    void add(const PassCounts& other);
    /// Adds them to \p words, in a fixed order.
    void write(std::vector<std::uint64_t>& words) const;
    /// Takes them from the front of \p words, which write() has made for as many species.
    void read(std::span<std::uint64_t>& words);
};

/// A thread's own: buffers, its bins of every tally, and the counts of the batch in progress.
struct Worker {
    Rays rays, secondaries;              ///< in flight; what the hits of a bounce sputter
    Column<std::uint32_t> hits;          ///< rows of the rays that hit the surface
    Column<std::uint32_t> word1, word2;  ///< random, for the directions of survivors
    std::vector<Column<std::uint64_t>>
        weights;                     ///< by species, where several share paths: Rays::weight of each
    std::vector<Tally::Bins*> bins;  ///< one a tally
    std::vector<Counts> counts;      ///< by species of the pass
    FlightCounts flights;            ///< of the pass
};

/// Traces particles [first, first + count) of a batch to their ends. Deterministic, whatever the worker did
/// before.
/// \param tallies  in the order of tally_names; if several species share paths, one each.
/// \pre count <= kBlock.
void trace_block(const Trace& trace, const Batch& batch, std::uint32_t first, std::uint32_t count,
                 const std::vector<Tally>& tallies, Worker& worker);

}  // namespace sidewall::flux
