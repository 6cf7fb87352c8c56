#pragma once
#include <span>

#include "surface/tetrahedra/tet_mesh.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Conforming tetrahedra of nested bodies in a box. Region k is body k without body k - 1; the last region,
/// if it is meshed, is the outside.
///
/// Cubes of six tetrahedra are bisected (Maubach, SIAM J. Sci. Comput. 16, 1995) until fronts are resolved.
/// Fronts are then cut into them one by one, from the outermost: vertices near a front move onto it, as in
/// isosurface stuffing (Labelle and Shewchuk, SIGGRAPH 2007), and edges that still cross it are split there.
/// Edge collapses, flips and moves within sides and fronts increase small dihedral angles. Straight edges cut
/// off curves and corners of the fronts, so fronts are offset at last to restore volumes. Vertices on the box
/// stay there to the last bit.
///
/// \param fronts  from the innermost outwards; each body lies within the next.
/// \returns regions without names and without triangles.
/// \throws TooManyTetrahedra if more than TetOptions::most are needed.
/// \note The same bits on any number of threads.
TetMesh tetrahedralize(std::span<const Front> fronts, const TetOptions& options);

}  // namespace sidewall::surface
