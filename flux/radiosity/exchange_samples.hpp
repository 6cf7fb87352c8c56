#pragma once
#include <Eigen/SparseCore>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "flux/radiosity/profile_view.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

// The balance of diffuse particles on a surface, from rays. With the hat functions phi of the wedges, the
// mass matrix M_ij = integral of phi_i phi_j and the exchange
//
//     G_ij = integral of phi_i(x) phi_j(y) K(x, y),    K = cos cos / (pi r^2) where x and y see each other,
//
// the flux g solves  M g = e + G (1 - s) g,  where e is the direct flux and s the sticking. A ray of weight w
// between the points a and b samples K; with the vectors b_a, b_b of the hat functions' values at its ends,
// it adds w (b_a b_b' + b_b b_a') to G. A ray from a that leaves the domain adds w b_a to e if it meets the
// source. The rays from a point cover all directions once: M is the sum of w b b' over all ends, and
//
//     M - G = sum over pairs of w (b_a - b_b)(b_a - b_b)' + sum over exits of w b_a b_a'.
//
// M - G is symmetric and positive semidefinite whatever the noise, and conserves particles exactly. Noise of
// a ray changes a flux elsewhere by w times the differences, between its ends, of the emission (1 - s) g and
// of the adjoint: a product of two small numbers. Matrix rows gathered singly would be off by one of them.
namespace sidewall::flux {

/// A ray that joins two points of the surface, given by triangles and by barycentric weights of their second
/// and third corners. The weight is an area.
struct PairSample {
    std::uint32_t a, b;
    float au, av, bu, bv;
    float weight;
};

/// A ray from a point of the surface that leaves the domain.
struct ExitSample {
    std::uint32_t a;
    float au, av;
    float weight;
    float cosine;  ///< cosine to the vertical if it meets the source plane; 0 past a side, where no source is
};

/// A cos^n source relative to a thermal one (n = 1): lobe_scale() lobe() = (n + 1) / 2 cos^(n - 1).
inline double lobe(double exponent, double cosine) {
    return exponent == 1.0 ? 1.0 : std::pow(cosine, exponent - 1.0);
}
inline double lobe_scale(double exponent) {
    return 0.5 * (exponent + 1.0);
}

/// Number of independent groups of samples; standard errors come from halves of them.
constexpr std::size_t kSampleGroups = 8;

/// Samples of one independent randomisation.
struct SampleGroup {
    std::vector<PairSample> pairs;
    std::vector<ExitSample> exits;
};

/// A sparse symmetric matrix with entries for wedges that share a triangle.
using WedgeMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Consistent mass matrix M of piecewise linear elements. O(n).
WedgeMatrix mass_matrix(const TriangleMesh& mesh, const Wedges& wedges);

/// Absorption s g as a function of the emission (1 - s) g: a symmetric matrix with the sparsity of \p mass.
/// \param ratio  s / (1 - s) by wedge.
WedgeMatrix absorption_matrix(const WedgeMatrix& mass, std::span<const double> area,
                              std::span<const double> ratio);

struct RingSky;

/// Samples of some groups, with weights balanced so that each wedge emits exactly its area. Independent of
/// sticking: one object serves all species and coverages. Parallel, with sums in a fixed order.
class BalancedSamples {
  public:
    /// Balances samples. The wedges and the groups must outlive the object.
    /// \param scale   factor on the samples' weights.
    /// \param sky     given if the groups' exits are exact: then only pairs are balanced; else nullptr.
    BalancedSamples(const Wedges& wedges, std::vector<const SampleGroup*> groups, double scale,
                    const RingSky* sky = nullptr);
    /// Balances the dense exchange of a profile.
    /// \param mass       of the profile's unknowns; must outlive the object.
    /// \param exponents  of the view's sources.
    BalancedSamples(const Wedges& wedges, const ProfileView& view, const WedgeMatrix& mass,
                    std::span<const double> exponents);
    /// Adds M - G times \p x to \p y.
    void add(std::span<const double> x, std::span<double> y) const;
    std::span<const double> diagonal() const { return diagonal_; }
    /// Direct flux e, tested by the hat functions, of a source cos^exponent.
    std::vector<double> direct(double exponent) const;
    /// G \p x: arrivals, tested by the hat functions, from an emission x of the surface.
    std::vector<double> arrivals(std::span<const double> x) const;

  private:
    struct Part;
    template <class Use>
    void for_pairs(const Part& part, const Use& use) const;  // use(n, its ends)
    template <class Use>
    void for_exits(const Part& part, const Use& use) const;  // use(n, its end)
    template <class Use>
    void sum_parts(std::span<double> y, const Use& use) const;
    const Wedges& wedges_;
    std::vector<const SampleGroup*> groups_;
    double scale_;
    std::vector<std::vector<float>> weights_;  // of the pairs of each group, balanced
    std::vector<std::vector<float>> exit_weights_;
    std::vector<double> diagonal_;
    struct Viewed {
        Eigen::MatrixXd exchange;
        const WedgeMatrix& mass;
    };
    std::optional<Viewed> viewed_{};
    std::map<double, std::vector<double>> direct_;  // by exponent; empty if direct() sums over samples
};

/// The matrix of the balance: absorption + M - G.
class Balance {
  public:
    /// \param absorption  from absorption_matrix(). Both must outlive the balance.
    Balance(const BalancedSamples& samples, const WedgeMatrix& absorption);
    /// \p y = the matrix times \p x.
    void apply(std::span<const double> x, std::span<double> y) const;
    std::span<const double> diagonal() const { return diagonal_; }

  private:
    const BalancedSamples& samples_;
    const WedgeMatrix& absorption_;
    std::vector<double> diagonal_;
};

}  // namespace sidewall::flux
