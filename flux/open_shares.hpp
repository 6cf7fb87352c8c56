#pragma once
#include <vector>

#include "flux/direct.hpp"
#include "flux/lateral.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// Visible shares, by beam, tally and wedge: the flux that is not shadowed, divided by that on an
/// unobstructed surface of the same normal; 0 for wedges that face away from the whole beam. Shares of tallies
/// differ in a penumbra, as what is visible of the source arrives at other angles or energies than the rest.
/// \param scene   of \p mesh.
/// \param box     from lateral_box(mesh, ...).
/// \param coarse  triangles are so large that the share varies within them: averages over every triangle of a
///                wedge's fan, as in an axial box. Else tests one point near the vertex, and averages only in
///                the penumbra.
/// \note O(triangles) rays, parallel, deterministic.
std::vector<std::vector<double>> open_shares(const DirectFlux& direct, const TriangleMesh& mesh,
                                             const surface::RayScene& scene, const LateralBox& box,
                                             const Wedges& wedges, bool coarse = false);

}  // namespace sidewall::flux
