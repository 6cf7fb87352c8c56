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

/// What a job's rays found.
struct Found {
    std::vector<Link> links;
    std::vector<Exit> exits;
    FlightCounts flights;
    std::uint64_t leaked = 0;
    // Of a pilot:
    std::vector<double> images;                ///< links by image
    std::vector<std::uint32_t> started;        ///< triangles that cosine rays left
    std::vector<std::uint32_t> lit, openings;  ///< triangle and cell of the plane of source rays that hit
};

/// Traces the rays of jobs. Thread-safe; what a job finds depends on nothing but the job.
class Gatherer {
  public:
    /// \param gather  numbers the gathers of an exchange: each draws other random numbers.
    Gatherer(const Exchange::State& state, RandomKey key, std::uint32_t gather)
        : s_(state), key_(key), gather_(gather) {}
    /// \pre job.count <= kBlock.
    Found trace(const Job& job, bool pilot) const;

  private:
    struct Block;
    struct Ray;
    std::uint32_t number(const Job& job) const;
    void draw(const Job& job, Block& block) const;
    void join(const Job& job, const Block& block, std::size_t row, bool pilot, Found& found) const;
    void join_exit(const Ray& ray, Found& found) const;
    void join_source(const Ray& ray, bool pilot, Found& found) const;
    void join_link(const Ray& ray, bool pilot, Found& found) const;

    const Exchange::State& s_;
    const RandomKey key_;
    const std::uint32_t gather_;
};

}  // namespace sidewall::flux
