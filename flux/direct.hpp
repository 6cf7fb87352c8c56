#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "flux/species.hpp"

namespace sidewall::flux {

/// Whether the direct fluxes of a species (those straight from its source) are functions of the surface
/// normal: true of ions and other particles with yields or reflection, if their source is narrow (cos^n with
/// n at least 10, or tabulated angles up to 45 degrees), nothing desorbs, and no gas collisions deflect them.
bool has_direct_flux(const Species& species);

/// Direct flux of a narrow source as a function F(n) of the surface's unit normal:
///
///     F_k(n) = mean over the source of max(0, -n . d) / (-d . z) Y_k(-n . d, E),
///
/// for the arrivals (Y_0 = 1) and the yield-weighted fluxes of a species, relative to the arrivals on an open
/// horizontal plane. A tilted beam over a rotating wafer is split into 16 fixed beams of equal weight, each
/// with its own visibility. F is tabulated over the polar angle about the beam and the azimuth around it.
class DirectFlux {
  public:
    /// \pre has_direct_flux(species).
    explicit DirectFlux(const Species& species);

    /// Number of fluxes: arrivals and yields, the first tallies of the species.
    std::size_t tallies() const { return 1 + yields_.size(); }
    std::size_t beams() const { return beams_; }
    /// A unit vector towards the source, its weight in the mean over the source, and the index of the energy
    /// factors of the particles that come from there.
    struct Direction {
        Vec3 towards;
        double weight;
        std::size_t energy;
    };
    /// Sample directions towards \p beam; the first few span all of it. Each comes with its mirror images in
    /// y and, unless the beam is tilted, in x, so that symmetric surfaces get symmetric fluxes.
    /// \param alike  images with the same visibility, of which one is kept: 2 (in y) for a profile in x and
    ///               z; 4 for a surface of revolution, whose directions are more and have no images; else 1.
    std::vector<Direction> towards(std::size_t beam, std::size_t alike) const;

    /// Lower bound of -d . z in the weight 1 / (-d . z), which diverges at grazing directions.
    static constexpr double kMinRise = 1e-2;

    /// What particles from \p direction bring to a tally, up to a constant factor, for a cosine of the
    /// incidence in (0, 1]: 1 for arrivals, the yield on material 0 at scale 1 for others.
    double brings(std::size_t tally, const Direction& direction, double cosine) const;

    /// Adds F_k(\p normal) on \p material to \p flux, by tally.
    /// \param open  by beam and tally: the share of F_k that comes from the visible part of the source.
    void add(const Vec3& normal, std::size_t material, std::span<const double> open,
             std::span<double> flux) const;

  private:
    double azimuth_of(std::size_t beam) const;
    double at(std::size_t tally, double cosine, double azimuth) const;

    std::size_t beams_ = 1, images_ = 1, azimuths_ = 1;  // images of each sample; azimuths in the table
    double tilt_sine_ = 0.0, tilt_cosine_ = 1.0, azimuth_ = 0.0;  // of the first beam's axis
    std::vector<Direction> in_space_, in_profile_, round_;        // towards the first beam at azimuth 0
    std::vector<Yield> yields_;
    std::vector<std::vector<double>> energetic_;  // energy factors by Direction::energy and yield
    std::vector<double> table_;                   // by tally, azimuth and polar angle, at scale 1
};

}  // namespace sidewall::flux
