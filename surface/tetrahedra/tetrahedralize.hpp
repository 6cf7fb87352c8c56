#pragma once
#include <span>

#include "surface/tetrahedra/tet_mesh.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Conforming tetrahedra of nested bodies in a box: region k is what body k holds and body k - 1 does not, and the
/// last one, if it is meshed, the outside.
///
/// Cubes of six tetrahedra are bisected (Maubach, SIAM J. Sci. Comput. 16, 1995) until fronts are resolved. Then the
/// fronts are cut into them one after the other, from the outermost: vertices near a front move onto it, as in
/// isosurface stuffing (Labelle and Shewchuk, SIGGRAPH 2007), and edges that still cross it are divided there. Edge
/// collapses, flips and moves within sides, fronts and contact lines then widen the smallest angles. Edges are chords of
/// curved fronts, and corners are cut: at last fronts are offset so that volumes hold. Vertices on the box stay there to
/// the last bit.
///
/// \param fronts   from the innermost; each body lies within the next.
/// \returns regions without names and without triangles.
/// \throws NumericsError if more tetrahedra are needed than there may be.
/// \note The same bits on any number of threads.
TetMesh tetrahedralize(std::span<const Front> fronts, const TetOptions& options);

}  // namespace sidewall::surface
