#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// The wedge flux that process models see: noise taken down where few particles arrived, nothing smeared across creases and
/// material edges where triangles are hit often enough.
///
/// A wedge whose triangles fewer than ten particles met moves towards the area-weighted mean of the linear flux
/// over its own triangles, by the share sigma^2 / (sigma^2 + tau^2): sigma its standard error, tau \p resolution times
/// the surface's mean flux. Elsewhere the tally stays: the mean flattens fluxes that bend, by 2 to 5 % of the depth
/// of holes a few cells wide. Where a wedge's triangles are so small that the average flux brings them fewer than ten arrivals, as
/// marching cubes has some that a single ray can raise tenfold, the mean is taken
/// over as many rings of neighbours as it takes to expect ten, across creases, too: clusters of tiny triangles
/// lie along those. Where nothing arrived the share is the odds that this is chance, by the hits that the mean
/// would have brought: shadows stay dark.
///
/// Reported fluxes and errors are never smoothed.
/// \param arrivals  how many hits the tally holds, for the expectation above.
/// \note O(n), deterministic.
std::vector<double> smoothed_flux(const TriangleMesh& mesh, const Wedges& wedges, const FluxField& wedge_flux,
                                  std::uint64_t arrivals, double resolution = 0.02);

/// A flux to be averaged.
struct Unaveraged {
    std::reference_wrapper<const std::vector<double>> flux;   ///< by wedge
    std::reference_wrapper<const std::vector<double>> error;  ///< by triangle: standard error of its mean
};

/// Averages fluxes over the surface around every wedge's vertex: over all points within \p radius (length
/// unit) of the wedge's material, each weighted by the cosine between its normal and the wedge's, so that
/// what faces away does not count. Beyond a reflective or periodic side the surface goes on.
///
/// A flux is linear over triangles, as wedges have it; errors are those of the average if different triangles
/// are hit independently. Triangles are sampled at points no farther apart than half the radius.
/// \param materials  one id a triangle, or empty if there is one material.
/// \returns one a flux, by wedge.
/// \throws RecipeError unless \p radius is above 0.
/// \note O(wedges x samples within the radius), parallel, deterministic.
std::vector<FluxField> averaged(const TriangleMesh& mesh, const LateralBox& box, const Wedges& wedges,
                                std::span<const std::int32_t> materials, std::span<const Unaveraged> fluxes,
                                double radius);

}  // namespace sidewall::flux
