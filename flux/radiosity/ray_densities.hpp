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

// Densities with which the three kinds of rays of a gather sample a pair of points. The weight of a ray is 1
// over their sum: multiple importance sampling, balance heuristic (Veach and Guibas, SIGGRAPH 1995).
namespace sidewall::flux {

/// The three kinds of rays.
enum class RayKind {
    cosine,   ///< from the surface, by Lambert's law
    connect,  ///< from the surface to a point drawn on the surface or source plane; counts if it gets there
    source    ///< from the source plane, by the law of the source
};

/// Number of rays of each kind in a group of a gather; source rays are counted for each exponent.
struct RayCounts {
    std::uint32_t cosine = 0, connect = 0, source = 0;
};

/// Number of images of the domain across each reflective or periodic side. An unfolded path ends in one of
/// kImageRow^2 images, numbered by rows with the domain itself in the middle, or in none (kNoImage).
constexpr int kImages = 2;
constexpr int kImageRow = 2 * kImages + 1;
constexpr int kNoImage = -1;
/// Least |z| of a unit direction across sides: a flatter path has no image, its length would be inaccurate.
constexpr double kLevel = 0.01;

/// A triangle from which rays start; coordinates are rounded to single precision like Embree's.
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
    std::vector<std::uint32_t> guide_;  // first item of each of n equal parts of the sum
    double total_ = 0.0;
};

/// Sampling densities of the rays of a gather, and the weights that follow from them.
class RayDensities {
  public:
    /// \param exponents  exponents n of the cos^n sources.
    RayDensities(const Geometry& geometry, const ProfileUnknowns& profile, std::vector<double> exponents);

    /// Starts half of the rays evenly, half in proportion to the root of the variance that a ray causes.
    /// \param variance  by triangle, for evenly started rays; empty: all rays start evenly.
    void set_starts(std::span<const double> variance);
    /// Sets how many rays of each kind a group traces from now on.
    void set_counts(const RayCounts& counts);
    const RayCounts& counts() const { return counts_; }
    /// Sets how many cosine rays ended in each image; connections choose images accordingly.
    void set_images(std::span<const double> hits);
    /// Sets weights of the kCells x kCells cells of the source plane, at which connections aim.
    void set_openings(std::span<const double> exits);
    /// Share of the rays from the surface that end on it, by item of starts(), averaged over 64 triangles.
    /// \param started, kept  numbers of rays that started, and of those that ended on the surface.
    std::vector<double> share_kept(std::span<const double> started, std::span<const double> kept) const;
    /// Sets the relays, at which connections aim: parts of the surface that see both the source and other
    /// parts. Deep places get most of their flux from there.
    /// \param lit   number of source rays that end there, by item of starts().
    /// \param kept  from share_kept().
    void set_relays(std::span<const double> lit, std::span<const double> kept);

    const std::vector<Facet>& facets() const { return facets_; }
    /// Whether the surface is one of revolution, given as a sector; its rays fly in space.
    bool round() const { return box_.axial; }
    /// Whether two triangles belong to the same facet.
    bool same_facet(std::uint32_t a, std::uint32_t b) const {
        return a == b || (!partner_.empty() && partner_[a] == b);
    }
    const std::vector<double>& exponents() const { return exponents_; }
    const Distribution& starts() const { return starts_; }
    std::uint32_t start_triangle(std::size_t item) const { return order_[item]; }
    std::size_t item_of(std::uint32_t triangle) const { return item_of_[triangle]; }

    /// A point that a connection aims at, on a triangle or, with kNoTriangle, on the source plane.
    struct Target {
        Vec3 point;  ///< in the chosen image: beyond the sides if that is not the domain itself
        Vec3 normal;
        std::uint32_t triangle;
        int image;
    };
    /// Draws a target by uniform numbers in [0, 1).
    /// \param which  the triangle or cell, and one coordinate on it.
    /// \param along  the other coordinate.
    /// \param image  the image, or the azimuth if round().
    Target target(double which, double along, double image) const;

    /// Image in which the end of an unfolded path lies, or kNoImage.
    int image_of(const Vec3& point) const;

    /// 1 / K for two points (exchange_samples.hpp): pi r^2 / (cos cos); r is \p length, cos cos \p cosines.
    static double form(double length, double cosines) {
        return std::numbers::pi * length * length / std::max(1e-12, cosines);
    }
    /// Weight of a ray between two triangles, by its form().
    double pair_weight(std::uint32_t a, std::uint32_t b, int image, double form) const {
        const double connect =
            image == kNoImage
                ? 0.0
                : (start_density_[a] * target_density_[b] + start_density_[b] * target_density_[a]) *
                      image_share_[static_cast<std::size_t>(image)];
        return 1.0 / (cosine_density_[a] + cosine_density_[b] + connect * form);
    }
    /// Weight of a ray from \p a that leaves to the source at \p point, at this \p cosine to the vertical.
    double exit_weight(std::uint32_t a, const Vec3& point, int image, double form, double cosine) const;
    /// Weight of a ray that leaves the domain elsewhere.
    double loss_weight(std::uint32_t a) const { return 1.0 / cosine_density_[a]; }

    static constexpr std::size_t kCells = 16;  ///< cells of the source plane along x and along y
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
    std::vector<double> even_share_, start_share_;  // share of each triangle among the start points
    std::vector<double> cosine_density_, start_density_, target_density_;  // by triangle, per area
    std::vector<double> cell_density_;                                     // by cell, per area
    std::vector<double> opening_, relay_;  // shares of cells, and of items of starts_
    std::array<double, std::size_t{kImageRow} * kImageRow> image_share_{};
    Distribution starts_, targets_, images_;
    RayCounts counts_;
};

}  // namespace sidewall::flux
