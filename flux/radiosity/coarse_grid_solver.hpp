#pragma once
#include <Eigen/Dense>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/radiosity/exchange_samples.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

// Coarse-grid correction: a two-level preconditioner by aggregation. In a deep cavity at low sticking
// particles move by diffusion, and the number of iterations of a local preconditioner grows with the depth.
// Together with a solve for the means of a few hundred aggregates it hardly depends on the depth.
namespace sidewall::flux {

/// Aggregates of neighbouring unknowns, of about equal size.
struct Aggregates {
    std::vector<std::uint32_t> of;  ///< aggregate of every unknown
    std::size_t count = 0;
};

/// Makes aggregates by recursive bisection along the longest extent. Deterministic.
Aggregates make_aggregates(const TriangleMesh& mesh, const Wedges& unknowns);

/// Adds the group's samples from \p first_pair and \p first_exit on to P' (M - G) P, where the columns of P
/// indicate the aggregates. The weights are those of the gather, not balanced.
void add_exchange(const Aggregates& aggregates, const Wedges& unknowns, const SampleGroup& group,
                  std::size_t first_pair, std::size_t first_exit, Eigen::MatrixXd& matrix);

/// P' (M - G) P of a dense exchange.
Eigen::MatrixXd aggregate_sums(const Aggregates& aggregates, const WedgeMatrix& mass,
                               const Eigen::MatrixXd& exchange);

/// Cholesky factorisation of the aggregates' balance P' A P, where A = absorption + M - G.
class CoarseGridSolver {
  public:
    /// \param exchange  P' (M - G) P from add_exchange() or aggregate_sums(), scaled.
    CoarseGridSolver(const Aggregates& aggregates, Eigen::MatrixXd exchange, const WedgeMatrix& absorption);
    /// Adds P (P' A P)^-1 P' \p r to \p z, for unknowns with a \p diagonal above 0.
    void add_correction(std::span<const double> r, std::span<const double> diagonal,
                        std::span<double> z) const;

  private:
    const Aggregates& aggregates_;
    Eigen::LLT<Eigen::MatrixXd> factor_;
    bool usable_ = false;
};

}  // namespace sidewall::flux
