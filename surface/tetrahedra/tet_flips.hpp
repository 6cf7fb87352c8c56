#pragma once
#include "surface/tetrahedra/tet_complex.hpp"

// Changes of the tetrahedra's connections; the mesher's own, not for others.
namespace sidewall::surface {

/// Removes an edge within a region by connecting the vertices around it otherwise (Shewchuk, "Two discrete optimization
/// algorithms for the topological improvement of tetrahedral meshes", 2002), if that widens the smallest angle.
bool remove_edge(TetComplex& mesh, std::uint32_t a, std::uint32_t b);

/// Puts an edge in the place of the face opposite to a corner, if both its tetrahedra are of a region and that widens
/// the smallest angle.
bool remove_face(TetComplex& mesh, std::uint32_t t, std::uint32_t corner);

}  // namespace sidewall::surface
