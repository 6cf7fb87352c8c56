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

/// Hits of whole particles whose weight 64 bits hold.
constexpr std::uint64_t kMostHits = std::uint64_t{1} << 36;

/// Sums arrivals on triangles and, by barycentric weights, on wedges and vertices, batch by batch. Every
/// thread has bins of its own, and bins are integers: neither locks nor the order of arrivals nor the threads
/// change a bit. Only one batch is held; earlier ones live on in their sums and sums of squares.
///
/// A bin of a batch, over all threads and ranks, holds kMostHits hits of whole particles. More than that, on all elements
/// together, ends the trace, so that no sum overflows; a yield's bins hold as many divided by the hits' mean yield.
class Tally {
  public:
    /// The bins of a thread for a batch.
    struct Bins {
        std::vector<std::uint64_t> triangle, wedge;
    };

    /// Both arguments must outlive the tally.
    Tally(const TriangleMesh& mesh, const Wedges& wedges);

    /// Bins of the calling thread. Keep the reference for many arrivals.
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

    /// Ends a batch; no add may run meanwhile. O(elements), parallel.
    void close_batch();

    /// Ends this rank's part of a batch that several share: adds a word for each of bin_count() to \p words.
    void take_batch(std::vector<std::uint64_t>& words);
    std::size_t bin_count() const { return triangles_.round.size() + by_wedge_.round.size(); }
    /// Ends the batch whose \p words are those of take_batch, summed over the ranks. Takes them.
    void close_batch(std::span<std::uint64_t> words);

    /// Ends a round of batches of equal numbers of rays, at least two; the next round's may be larger.
    /// Variances of rounds add up; those from fewer than 16 batches so that their roots are right on average.
    void close_round();

    /// Fluxes from all closed rounds. \p area_per_ray: the source's area over the number of rays of all
    /// rounds. Elements without area get flux 0.
    FluxField triangle_flux(double area_per_ray) const;
    FluxField wedge_flux(double area_per_ray) const;
    FluxField vertex_flux(double area_per_ray) const;

  private:
    struct Sum {  // over the batches of a round
        double sum = 0.0, squares = 0.0;
        void add(std::uint64_t bin) {
            const double x = static_cast<double>(bin) * 0x1p-28;
            sum += x;
            squares += x * x;
        }
    };
    struct Total {  // over the rounds closed
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
    std::vector<std::uint32_t> split_;  // vertices of more than one wedge; the others' flux is their wedge's
    Sums triangles_, by_wedge_, by_split_;
    std::uint32_t batches_ = 0;  // of the round in progress
};

}  // namespace sidewall::flux
