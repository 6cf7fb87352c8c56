#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/wedges.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

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
