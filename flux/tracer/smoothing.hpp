#pragma once
#include <cstdint>
#include <vector>

#include "flux/wedges.hpp"

namespace sidewall::flux {

/// The wedge flux that process models see: noise taken down, nothing smeared across creases and material
/// edges where triangles are hit often enough.
///
/// Each wedge moves towards the area-weighted mean of the linear flux over its own triangles, by the share
/// sigma^2 / (sigma^2 + tau^2): sigma its standard error, tau \p resolution times the surface's mean flux.
/// Where the tally is sharper than tau it stays, so that coarse triangles with many hits are not blurred; the
/// tiny wedges of marching cubes, which a single ray can raise tenfold, take their neighbours' value. Where a
/// wedge's triangles are so small that the average flux brings them fewer than ten arrivals, the mean is taken
/// over as many rings of neighbours as it takes to expect ten, across creases, too: clusters of tiny triangles
/// lie along those. Where nothing arrived the share is the odds that this is chance, by the hits that the mean
/// would have brought: shadows stay dark.
///
/// Reported fluxes and errors are never smoothed.
/// \param arrivals  how many hits the tally holds, for the expectation above.
/// \note O(n), deterministic.
std::vector<double> smoothed_flux(const TriangleMesh& mesh, const Wedges& wedges, const FluxField& wedge_flux,
                                  std::uint64_t arrivals, double resolution = 0.02);

}  // namespace sidewall::flux
