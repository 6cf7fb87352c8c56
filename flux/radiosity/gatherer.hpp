#pragma once
#include <cstdint>
#include <vector>

#include "flux/radiosity/exchange.hpp"
#include "flux/random.hpp"
#include "flux/tracer/packets.hpp"

namespace sidewall::flux {

/// A block of consecutive rays of one kind in one group.
struct Job {
    std::uint32_t group = 0;
    RayKind kind = RayKind::cosine;
    std::uint32_t exponent = 0;  ///< index of the source exponent, for source rays
    std::uint32_t first = 0, count = 0;
};

/// The samples that a job's rays found.
struct BlockSamples {
    std::vector<PairSample> pairs;
    std::vector<ExitSample> exits;
    FlightCounts flights;
    std::uint64_t leaked = 0;
    // Filled in by a pilot only:
    std::vector<double> images;                ///< number of pairs by image
    std::vector<std::uint32_t> started;        ///< start triangle of each cosine ray
    std::vector<std::uint32_t> lit, openings;  ///< triangle and source plane cell of source rays that hit
};

/// Traces the rays of a job. Thread-safe; the samples depend on the job alone.
/// \param gather  number of the gather, a key of the random numbers.
/// \param pilot   whether to fill in the members for a pilot.
/// \pre job.count <= kBlock.
BlockSamples trace_job(const Exchange::State& state, RandomKey key, std::uint32_t gather, const Job& job,
                       bool pilot);

}  // namespace sidewall::flux
