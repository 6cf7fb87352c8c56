#pragma once
#include <cstdint>
#include <vector>

#include "flux/radiosity/exchange_state.hpp"
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

/// Traces the rays of jobs. Thread-safe; the samples of a job depend on the job alone.
class Gatherer {
  public:
    /// \param gather  numbers the gathers of an exchange: each draws other random numbers.
    Gatherer(const Exchange::State& state, RandomKey key, std::uint32_t gather)
        : s_(state), key_(key), gather_(gather) {}
    /// \pre job.count <= kBlock.
    BlockSamples trace(const Job& job, bool pilot) const;

  private:
    struct Block;
    struct Ray;
    std::uint32_t number(const Job& job) const;
    void draw(const Job& job, Block& block) const;
    void join(const Job& job, const Block& block, std::size_t row, bool pilot, BlockSamples& found) const;
    void join_exit(const Ray& ray, BlockSamples& found) const;
    void join_source(const Ray& ray, bool pilot, BlockSamples& found) const;
    void join_pair(const Ray& ray, bool pilot, BlockSamples& found) const;

    const Exchange::State& s_;
    const RandomKey key_;
    const std::uint32_t gather_;
};

}  // namespace sidewall::flux
