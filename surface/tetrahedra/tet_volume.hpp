#pragma once
#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Moves vertices between two materials along their normals, by at most TetOptions::shift and where that leaves no angle
/// under 8 degrees, until every material has the volume asked for.
void match_volumes(TetComplex& mesh, const TetOptions& options);

}  // namespace sidewall::surface
