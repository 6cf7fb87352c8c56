#pragma once
#include <cstdint>
#include <vector>

#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// A flux and its standard error, one of each an element. Relative: 1 on an open plane.
struct FluxField {
    std::vector<double> flux, error;
};

/// Counts arrivals on triangles and, weighted by barycentric coordinates, on wedges and vertices, batch by
/// batch. Counts are integers and weights 64-bit fixed point, so the order of arrivals does not change a bit.
/// Only one batch is held; earlier ones live on in their sum and sum of squares.
class Tally {
  public:
    /// Both arguments must outlive the tally.
    Tally(const TriangleMesh& mesh, const Wedges& wedges);

    /// Adds an arrival on \p triangle at barycentric weights \p u, \p v of its second and third corner.
    /// Thread-safe.
    void add(std::uint32_t triangle, double u, double v);

    /// Ends a batch; no add may run meanwhile.
    void close_batch();

    /// Fluxes from all closed batches, of the same number of rays each. \p area_per_ray: the source's area
    /// over the number of rays of all batches. Elements without area get flux 0. At least two batches.
    FluxField triangle_flux(double area_per_ray) const;
    FluxField wedge_flux(double area_per_ray) const;
    FluxField vertex_flux(double area_per_ray) const;

  private:
    struct Sums {
        std::vector<double> sum, squares;
        explicit Sums(std::size_t n) : sum(n, 0.0), squares(n, 0.0) {}
        void add(std::size_t i, double x) {
            sum[i] += x;
            squares[i] += x * x;
        }
    };
    FluxField flux_of(const Sums& sums, const std::vector<double>& area, double area_per_ray) const;

    const TriangleMesh& mesh_;
    const Wedges& wedges_;
    std::vector<std::uint64_t> triangle_hits_, wedge_weights_;  // of the batch in progress
    Sums triangles_, by_wedge_, by_vertex_;
    std::uint32_t batches_ = 0;
};

}  // namespace sidewall::flux
