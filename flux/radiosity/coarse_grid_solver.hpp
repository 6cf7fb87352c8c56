#pragma once
#include <Eigen/Dense>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/radiosity/exchange_samples.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

// Coarse-grid solver: two-level preconditioning by aggregation. In a deep cavity of low sticking particles
// diffuse, and an iteration that couples neighbours alone takes as many steps as the cavity is deep; solved
// for the means of a few hundred aggregates as well, it takes a number that hardly depends on the depth.
namespace sidewall::flux {

/// Aggregates of unknowns near each other, of about equal number.
struct Aggregates {
    std::vector<std::uint32_t> of;  ///< aggregate of every unknown
    std::size_t count = 0;
};

/// Halves the unknowns by their place along the longest extent, again and again. Deterministic.
Aggregates make_aggregates(const TriangleMesh& mesh, const Wedges& unknowns);

/// Adds samples from \p first_pair and \p first_exit on to P' (M - G) P, P the aggregates' indicators, with the
/// weights that they were gathered with.
void add_exchange(const Aggregates& aggregates, const Wedges& unknowns, const SampleGroup& group,
                  std::size_t first_pair, std::size_t first_exit, Eigen::MatrixXd& matrix);

/// P' (M - G) P of a dense exchange.
Eigen::MatrixXd aggregate_sums(const Aggregates& aggregates, const WedgeMatrix& mass,
                               const Eigen::MatrixXd& exchange);

/// The balance of the aggregates, factorised.
class CoarseGridSolver {
  public:
    /// \param exchange  of add_exchange, scaled.
    CoarseGridSolver(const Aggregates& aggregates, Eigen::MatrixXd exchange, const WedgeMatrix& absorption);
    /// Adds P (P' A P)^-1 P' \p r to \p z, for the unknowns whose \p diagonal is above 0.
    void add_correction(std::span<const double> r, std::span<const double> diagonal,
                        std::span<double> z) const;

  private:
    const Aggregates& aggregates_;
    Eigen::LLT<Eigen::MatrixXd> factor_;
    bool usable_ = false;
};

}  // namespace sidewall::flux
