#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/species.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// Whether the fluxes that come straight from the species' source are known as functions of the surface's normal: ions, or
/// what else has yields or reflection, from a narrow source (cos^n with n of 10 or more, or tabulated angles within 45
/// degrees) and without collisions on the way.
bool has_direct_flux(const Species& species);

/// What reaches a surface straight from a narrow source, as a function F(n) of the surface's unit normal:
///
///     F_k(n) = mean over the source of max(0, -n . d) / (-d . z) Y_k(-n . d, E),
///
/// the arrivals (Y = 1) and the yield-weighted fluxes of a species, relative to the arrivals on an open horizontal
/// plane. A source that turns about the vertical is a number of beams of equal weight, each of which a surface may see or
/// not. F is tabulated over the polar angle about the beam and the azimuth around it.
class DirectFlux {
  public:
    /// \pre has_direct_flux(species).
    explicit DirectFlux(const Species& species);

    /// Arrivals and yields: the first tallies of the species.
    std::size_t tallies() const { return scale_.size(); }
    std::size_t beams() const { return beams_; }
    /// A unit vector towards the source, and the part of the source that it stands for.
    struct Direction {
        Vec3 towards;
        double weight;
    };
    /// Directions towards beam \p beam of the source that stand for all of it.
    /// Each comes with its mirror images in x, unless the beam is tilted, and in y, so that symmetric surfaces get the same.
    /// \param alike  images of a direction of which one is taken: 2, those in y, of a profile in x and z; 4 of a round wafer,
    ///               whose directions are many instead; else 1.
    std::vector<Direction> towards(std::size_t beam, std::size_t alike) const;

    /// Adds F_k(\p normal) on \p material to \p flux, by tally.
    /// \param open  by beam: the share of it that the surface sees.
    void add(const Vec3& normal, std::size_t material, std::span<const double> open,
             std::span<double> flux) const;

  private:
    double azimuth_of(std::size_t beam) const;
    double at(std::size_t tally, double cosine, double azimuth) const;

    std::size_t beams_ = 1, images_ = 1, azimuths_ = 1;  // images: of a sample; azimuths: of the table
    double tilt_sine_ = 0.0, tilt_cosine_ = 1.0, azimuth_ = 0.0;  // of the first beam's axis
    std::vector<Direction> sample_, round_;  // towards the first beam, if its azimuth were 0; on round wafers
    std::vector<std::vector<double>> scale_;  // by tally, by material or one for all
    std::vector<double> table_;               // by tally, azimuth and polar angle, at scale 1
};

/// The share of what each beam would send to a wedge of an open surface that nothing else hides, by beam and wedge; 0 for
/// wedges that turn away from the whole beam.
/// \param scene   of \p mesh.
/// \param box     from lateral_box(mesh, ...).
/// \param coarse  the share may change along a triangle: it is a mean over every triangle of a wedge's fan, as it is on
///                round wafers; else that of one place near the vertex.
/// \note O(triangles) rays, parallel, deterministic.
std::vector<std::vector<double>> open_shares(const DirectFlux& direct, const TriangleMesh& mesh,
                                             const surface::RayScene& scene, const LateralBox& box,
                                             const Wedges& wedges, bool coarse = false);

}  // namespace sidewall::flux
