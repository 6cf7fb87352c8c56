#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// The wedge flux that process models use: the tally, with noise reduced where few particles arrived.
/// Reported fluxes and errors are never smoothed.
///
/// If a wedge's triangles got fewer than ten arrivals, its flux moves towards the area-weighted mean of the
/// linear flux over these triangles, none of which is beyond a crease or material edge. It moves by the share
/// sigma^2 / (sigma^2 + tau^2): sigma is its standard error, tau \p resolution times the surface's mean flux.
/// Elsewhere the tally stays: the mean flattens curved fluxes, which changes the depth of holes a few cells
/// (dx) wide by 2 to 5 %.
///
/// Marching cubes makes triangles so small that a single ray can raise their flux tenfold. Where a wedge's
/// triangles would get fewer than ten arrivals at the mean flux, the mean is taken over enough rings of
/// neighbours to expect ten, across creases, too, along which such clusters lie. A wedge without arrivals
/// moves by the probability that chance missed it, from the hits expected at the mean: shadows stay dark.
/// \param arrivals  number of hits in the tally.
/// \note O(n), deterministic.
std::vector<double> smoothed_flux(const TriangleMesh& mesh, const Wedges& wedges, const FluxField& wedge_flux,
                                  std::uint64_t arrivals, double resolution = 0.02);

/// A flux to be averaged, by reference.
struct Unaveraged {
    std::reference_wrapper<const std::vector<double>> flux;   ///< by wedge
    std::reference_wrapper<const std::vector<double>> error;  ///< standard error of the mean, by triangle
};

/// Averages fluxes around every wedge's vertex, over the points of its material within \p radius (world
/// units). Each is weighted by the cosine between its normal and the wedge's, and not counted if that is
/// negative. Beyond reflective and periodic sides the surface is continued.
///
/// Fluxes are linear over triangles, by their wedges. Errors assume that different triangles are hit
/// independently. Triangles are sampled at points no farther apart than half the radius.
/// \param materials  one id a triangle, or empty if there is one material.
/// \returns one field for each flux, by wedge.
/// \throws RecipeError unless \p radius is above 0.
/// \note O(wedges x samples within the radius), parallel, deterministic.
std::vector<FluxField> averaged(const TriangleMesh& mesh, const LateralBox& box, const Wedges& wedges,
                                std::span<const std::int32_t> materials, std::span<const Unaveraged> fluxes,
                                double radius);

}  // namespace sidewall::flux
