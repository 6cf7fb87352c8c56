#pragma once
#include <span>

#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Increases dihedral angles below TetOptions::target_deg by merges, moves, flips and added vertices.
void improve(TetComplex& mesh, std::span<const Front> fronts, const TetOptions& options);

}  // namespace sidewall::surface
