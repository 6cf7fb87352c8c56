#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/tracer/flight.hpp"

// Densities with which the three kinds of rays of a gather sample a pair of points. Multiple importance
// sampling by the balance heuristic (Veach and Guibas, SIGGRAPH 1995) weighs every ray by one over their sum.
namespace sidewall::flux {

/// The three kinds of rays.
enum class RayKind {
    cosine,   ///< from the surface, by Lambert's law
    connect,  ///< from the surface to a point drawn on the surface or the source plane, counted if it gets
              ///< there
    source    ///< from the source plane, by its law
};

/// Rays of each kind in a group of a gather; source: for each exponent.
struct RayCounts {
    std::uint32_t cosine = 0, connect = 0, source = 0;
};

/// Images of the domain across reflective or periodic sides, in one of which a straightened path ends: (2 kImages +
/// 1)^2, numbered by rows, the domain itself in the middle; or kNoImage.
constexpr int kImages = 2;
constexpr int kImageRow = 2 * kImages + 1;
constexpr int kNoImage = -1;
/// A path less steep than this that crosses sides has no image: its length is not known well.
constexpr double kLevel = 0.01;

/// A triangle as rays start from it; single precision as Embree's.
struct Facet {
    Vec3 corner, edge1, edge2, normal;
    double area = 0.0;
};

/// A discrete distribution sampled by its cumulative sums.
class Distribution {
  public:
    void assign(std::vector<double> weights);
    double share(std::size_t i) const { return (cumulative_[i + 1] - cumulative_[i]) / total_; }
    struct Pick {
        std::size_t item;
        double rest;  ///< uniform in [0, 1) within the item
    };
    Pick pick(double u) const;

  private:
    std::vector<double> cumulative_;
    std::vector<std::uint32_t> guide_;  // first item of equal parts of the sum
    double total_ = 0.0;
};

/// Everything that decides the rays of a gather and their weights.
class RayDensities {
  public:
    /// \param exponents  of the sources.
    RayDensities(const Geometry& geometry, const ProfileUnknowns& profile, std::vector<double> exponents);

    /// Starts half of the rays evenly, half in proportion to the square root of the \p variance, by triangle, that an even
    /// start has there.
    void set_starts(std::span<const double> variance);
    /// Sets how many rays of each kind a group traces from now on.
    void set_counts(const RayCounts& counts);
    const RayCounts& counts() const { return counts_; }
    /// Sets how often paths of cosine rays end in each image; sampled connections follow it.
    void set_images(std::span<const double> hits);
    /// Sets how often rays from the surface leave through each of the kCells x kCells cells of the source plane.
    void set_openings(std::span<const double> exits);
    /// The share of the rays from the surface that end on it, by item of starts(), over runs of the curve.
    std::vector<double> share_kept(std::span<const double> started, std::span<const double> kept) const;
    /// Sets the relays: parts of the surface that see both the source and other parts. Deep places get most of
    /// their flux from there.
    /// \param lit   source rays that end there, by item of starts().
    /// \param kept  from share_kept.
    void set_relays(std::span<const double> lit, std::span<const double> kept);

    const std::vector<Facet>& facets() const { return facets_; }
    /// Whether the surface is a sector, whose rays fly in space: what starts in it ends anywhere around.
    bool round() const { return box_.axial; }
    /// Whether two triangles are one facet.
    bool are_one(std::uint32_t a, std::uint32_t b) const {
        return a == b || (!partner_.empty() && partner_[a] == b);
    }
    const std::vector<double>& exponents() const { return exponents_; }
    const Distribution& starts() const { return starts_; }
    std::uint32_t start_triangle(std::size_t item) const { return order_[item]; }
    std::size_t item_of(std::uint32_t triangle) const { return item_of_[triangle]; }

    /// A point that a connection aims at, on a triangle or, with kNoTriangle, on the source plane.
    struct Target {
        Vec3 point;  ///< straightened: beyond the sides if the image is not the domain's own
        Vec3 normal;
        std::uint32_t triangle;
        int image;
    };
    /// From three numbers in [0, 1): which, and where on it; and a fourth: which image, or of a sector where around.
    Target target(double which, double along, double image) const;

    /// Image that the straightened point lies in.
    int image_of(const Vec3& point) const;

    /// The inverse of the exchange K between two points at distance \p length with this product of \p cosines: pi
    /// r^2 / (cos cos).
    static double form(double length, double cosines) {
        return std::numbers::pi * length * length / std::max(1e-12, cosines);
    }
    /// Weight of a ray between two triangles, see form.
    double pair_weight(std::uint32_t a, std::uint32_t b, int image, double form) const {
        const double connect =
            image == kNoImage
                ? 0.0
                : (start_density_[a] * target_density_[b] + start_density_[b] * target_density_[a]) *
                      image_share_[static_cast<std::size_t>(image)];
        return 1.0 / (cosine_density_[a] + cosine_density_[b] + connect * form);
    }
    /// Weight of a ray from \p a that leaves to the source through \p point at \p cosine to the vertical.
    double exit_weight(std::uint32_t a, const Vec3& point, int image, double form, double cosine) const;
    /// Weight of a ray that leaves the domain elsewhere.
    double loss_weight(std::uint32_t a) const { return 1.0 / cosine_density_[a]; }

    static constexpr std::size_t kCells = 16;  ///< of the source plane, each way
    std::size_t cell_of(const Vec3& point) const;

  private:
    Vec3 unfolded(Vec3 point, int image) const;
    void make_targets();

    const LateralBox box_;
    const double top_;
    std::vector<double> exponents_, lobes_;  // lobe_scale of each
    std::vector<Facet> facets_;
    std::vector<std::uint32_t> order_, item_of_;    // triangles along a space-filling curve, and back
    std::vector<std::uint32_t> partner_;            // see ProfileUnknowns
    std::vector<double> even_share_, start_share_;  // of a triangle, of the rays that start on the surface
    std::vector<double> cosine_density_, start_density_, target_density_;  // by triangle
    std::vector<double> cell_density_;
    std::vector<double> opening_, relay_;  // shares of cells, and of items of starts_
    std::array<double, std::size_t{kImageRow} * kImageRow> image_share_{};
    Distribution starts_, targets_, images_;
    RayCounts counts_;
};

}  // namespace sidewall::flux
