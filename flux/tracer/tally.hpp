#pragma once
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// Hits of whole particles (2^28 each) that fill 64 bits.
constexpr std::uint64_t kMostHits = std::uint64_t{1} << 36;

/// Sums arrivals on triangles and, by barycentric weights, on wedges and vertices, batch by batch. Every
/// thread has its own bins of integers: there are no locks, and no bit depends on the order of arrivals or
/// the threads. Only the current batch is kept; of earlier ones, sums and sums of squares.
///
/// In one batch, over all threads and ranks, a bin can hold kMostHits hits of whole particles; a yield's
/// bin, as many divided by the hits' mean yield. A batch of kMostHits ray segments ends the trace before sums
/// overflow.
class Tally {
  public:
    /// One thread's sums for the current batch, in units of 1 / kOne.
    struct Bins {
        std::vector<std::uint64_t> triangle, wedge;
    };

    /// Both arguments must outlive the tally.
    Tally(const TriangleMesh& mesh, const Wedges& wedges);

    /// Bins of the calling thread. Looking them up is slow: keep the reference.
    Bins& bins();

    /// Adds \p weight, in units of 1 / kOne, arriving on \p triangle at barycentric weights \p u, \p v of its
    /// second and third corner.
    void add(Bins& bins, std::uint32_t triangle, float u, float v, std::uint64_t weight) const {
        const std::uint64_t second = share(u, weight, weight), third = share(v, weight, weight - second);
        const std::uint32_t* corner = wedges_of(triangle);
        bins.triangle[triangle] += weight;
        bins.wedge[corner[0]] += weight - second - third;
        bins.wedge[corner[1]] += second;
        bins.wedge[corner[2]] += third;
    }

    /// Indices of a triangle's wedges, which add() reads.
    const std::uint32_t* wedges_of(std::uint32_t triangle) const {
        return &wedges_.corner[3 * std::size_t{triangle}];
    }

    /// Ends a batch; no add() may run at the same time. O(elements), parallel.
    void close_batch();

    /// Ends this rank's part of a shared batch: appends its bin_count() sums to \p words.
    void take_batch(std::vector<std::uint64_t>& words);
    std::size_t bin_count() const { return triangles_.round.size() + by_wedge_.round.size(); }
    /// Ends a shared batch from the \p words of take_batch, summed over the ranks; sets them to 0.
    void close_batch(std::span<std::uint64_t> words);

    /// Ends a round: at least two batches of equal numbers of rays, which may differ from round to round.
    /// Variances of rounds add up; from fewer than 16 batches they are enlarged to unbias standard errors.
    void close_round();

    /// Fluxes from all closed rounds; 0 on elements without area.
    /// \param area_per_ray  the source's area over the number of rays of all rounds.
    FluxField triangle_flux(double area_per_ray) const;
    FluxField wedge_flux(double area_per_ray) const;
    FluxField vertex_flux(double area_per_ray) const;

  private:
    struct Sum {  // over the batches of a round, in particles
        double sum = 0.0, squares = 0.0;
        void add(std::uint64_t bin) {
            const double x = static_cast<double>(bin) * 0x1p-28;
            sum += x;
            squares += x * x;
        }
    };
    struct Total {  // over all closed rounds
        double sum = 0.0, variance = 0.0;
    };
    struct Sums {
        std::vector<Sum> round;
        std::vector<Total> total;
        explicit Sums(std::size_t n) : round(n), total(n) {}
    };
    static std::uint64_t share(float part, std::uint64_t weight, std::uint64_t limit) {
        const auto amount = static_cast<std::int64_t>(part * static_cast<float>(weight));
        return std::min(limit, static_cast<std::uint64_t>(std::max<std::int64_t>(0, amount)));
    }
    static FluxField flux_of(const Sums& sums, const std::vector<double>& area, double area_per_ray);
    void close_batch(const std::vector<std::uint64_t*>& triangle, const std::vector<std::uint64_t*>& wedge);

    const TriangleMesh& mesh_;
    const Wedges& wedges_;
    tbb::enumerable_thread_specific<Bins> bins_;
    std::vector<std::uint32_t> split_;  // vertices of more than one wedge; others have their wedge's flux
    Sums triangles_, by_wedge_, by_split_;
    std::uint32_t batches_ = 0;  // closed in the current round
};

}  // namespace sidewall::flux
