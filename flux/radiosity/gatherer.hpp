#pragma once
#include <cstdint>
#include <vector>

#include "flux/radiosity/exchange.hpp"
#include "flux/random.hpp"
#include "flux/tracer/packets.hpp"

namespace sidewall::flux {

/// Some consecutive rays of one kind in one group.
struct Job {
    std::uint32_t group = 0;
    RayKind kind = RayKind::cosine;
    std::uint32_t exponent = 0;  ///< of a source ray
    std::uint32_t first = 0, count = 0;
};

/// The samples that a job's rays found.
struct BlockSamples {
    std::vector<PairSample> pairs;
    std::vector<ExitSample> exits;
    FlightCounts flights;
    std::uint64_t leaked = 0;
    // Filled in by a pilot alone:
    std::vector<double> images;                ///< pairs by image
    std::vector<std::uint32_t> started;        ///< triangles that cosine rays left
    std::vector<std::uint32_t> lit, openings;  ///< triangle and cell of the plane of source rays that hit
};

/// Traces the rays of a job. Thread-safe; the samples depend on the job alone.
/// \param gather  numbers the gathers of an exchange: each draws other random numbers.
/// \pre job.count <= kBlock.
BlockSamples trace_job(const Exchange::State& state, RandomKey key, std::uint32_t gather, const Job& job,
                       bool pilot);

}  // namespace sidewall::flux
