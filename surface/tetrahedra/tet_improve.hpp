#pragma once
#include <span>

#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Widens angles below the target.
void improve(TetComplex& mesh, std::span<const Front> fronts, const TetOptions& options);

}  // namespace sidewall::surface
