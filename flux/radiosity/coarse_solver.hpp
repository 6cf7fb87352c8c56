#pragma once
#include <Eigen/Dense>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/radiosity/exchange_samples.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

// What passes between a few hundred pieces of the surface. In a deep cavity of low sticking particles
// diffuse, and an iteration that only looks at neighbours takes as many steps as the cavity is deep; solved
// for the pieces' means as well, it takes a number that hardly depends on the depth (two-level
// preconditioning by aggregation).
namespace sidewall::flux {

/// The unknowns in pieces near each other, of about equal number.
struct Pieces {
    std::vector<std::uint32_t> of;  ///< piece of every unknown
    std::size_t count = 0;
};

/// Halves the unknowns by their place along the longest extent, again and again. Deterministic.
Pieces make_pieces(const TriangleMesh& mesh, const Wedges& unknowns);

/// Adds what links and exits from \p first_link and \p first_exit on contribute to P' (M - G) P, P the pieces' indicators, with the
/// weights that they were gathered with.
void add_links(const Pieces& pieces, const Wedges& unknowns, const LinkGroup& group, std::size_t first_link,
               std::size_t first_exit, Eigen::MatrixXd& matrix);

/// The balance of the pieces, factorised.
class CoarseSolver {
  public:
    /// \param links       of add_links, scaled.
    /// \param absorption  by entry of \p mass.
    CoarseSolver(const Pieces& pieces, Eigen::MatrixXd links, const MassMatrix& mass,
                 std::span<const double> absorption);
    /// Adds P (P' A P)^-1 P' \p r to \p z, for the unknowns whose \p diagonal is above 0.
    void add_correction(std::span<const double> r, std::span<const double> diagonal,
                        std::span<double> z) const;

  private:
    const Pieces& pieces_;
    Eigen::LLT<Eigen::MatrixXd> factor_;
    bool usable_ = false;
};

}  // namespace sidewall::flux
