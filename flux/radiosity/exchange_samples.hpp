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

// The balance of diffuse particles on a surface, from rays. With hat functions phi of the wedges, the mass
// matrix M_ij = integral of phi_i phi_j, and what passes from one to the other,
//
//     G_ij = integral of phi_i(x) phi_j(y) K(x, y),    K = cos cos / (pi r^2) where x and y see each other,
//
// the flux g solves  M g = e + G (1 - s) g.  A ray between the points a and b, of weight w, stands for w of
// K; with the hat functions' values b_a, b_b there, it adds w (b_a b_b' + b_b b_a') to G. A ray from a that
// leaves the domain adds w b_a to e if it comes from the source. All of a point's rays together see
// everything once, so M is the sum of w b b' over all ends of rays, and
//
//     M - G = sum over pairs of w (b_a - b_b)(b_a - b_b)' + sum over exits of w b_a b_a'.
//
// This form is symmetric and never negative whatever the noise, conserves particles exactly, and its noise
// moves a flux somewhere else by w times the difference of the flux between the ray's ends times that of the
// adjoint: a product of two small numbers, where rows gathered one by one are off by one small number.
namespace sidewall::flux {

/// A ray that joins two points of the surface: triangles and barycentric weights of their second and third
/// corners. The weight is an area.
struct PairSample {
    std::uint32_t a, b;
    float au, av, bu, bv;
    float weight;
};

/// A ray from a point of the surface out of the domain.
struct ExitSample {
    std::uint32_t a;
    float au, av;
    float weight;
    float cosine;  ///< to the vertical, through the source plane; 0 past a side, where no source is
};

/// A source's law relative to a thermal one is lobe_scale times lobe: (n + 1) / 2 cos^(n - 1).
inline double lobe(double exponent, double cosine) {
    return exponent == 1.0 ? 1.0 : std::pow(cosine, exponent - 1.0);
}
inline double lobe_scale(double exponent) {
    return 0.5 * (exponent + 1.0);
}

/// Independent groups of samples, whose halves give standard errors.
constexpr std::size_t kSampleGroups = 8;

/// Samples of one of the independent randomisations.
struct SampleGroup {
    std::vector<PairSample> pairs;
    std::vector<ExitSample> exits;
};

/// A symmetric matrix whose entries are those of wedges of shared triangles.
using WedgeMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// M of piecewise linear elements. O(n).
WedgeMatrix mass_matrix(const TriangleMesh& mesh, const Wedges& wedges);

/// Absorption of an emission by the wedges as a symmetric matrix of the same entries as \p mass.
/// \param ratio  s / (1 - s) by wedge.
WedgeMatrix absorption_matrix(const WedgeMatrix& mass, std::span<const double> area,
                              std::span<const double> ratio);

struct RingSky;

/// Samples of some groups with balanced weights: exactly its area leaves each wedge's part of the surface.
/// Independent of sticking, so that one serves all species and coverages. Parallel, in a fixed order.
class BalancedSamples {
  public:
    /// \param wedges  and the groups must outlive it.
    /// \param scale   of the samples' weights.
    /// \param sky     all of the groups' exits, which are exact: pairs alone are balanced; or nullptr.
    BalancedSamples(const Wedges& wedges, std::vector<const SampleGroup*> groups, double scale,
                    const RingSky* sky = nullptr);
    /// The exchange of a profile, which is no sum over samples.
    /// \param mass, exponents  of the profile's unknowns, and of the view's sources.
    BalancedSamples(const Wedges& wedges, const ProfileView& view, const WedgeMatrix& mass,
                    std::span<const double> exponents);
    /// Adds M - G times \p x to \p y.
    void add(std::span<const double> x, std::span<double> y) const;
    std::span<const double> diagonal() const { return diagonal_; }
    /// e of a source cos^exponent.
    std::vector<double> direct(double exponent) const;
    /// G \p x: what arrives of a surface's emission x.
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
    std::map<double, std::vector<double>> direct_;  // by exponent, where it is no sum over samples
};

/// The matrix of the balance: absorption + M - G.
class Balance {
  public:
    /// \param absorption  of absorption_matrix. Both must outlive the balance.
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
