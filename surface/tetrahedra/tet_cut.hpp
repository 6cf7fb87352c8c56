#pragma once
#include <span>

#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Cuts front \p k into the tetrahedra of region k + 1: those inside it become region k.
void cut_front(TetComplex& mesh, std::span<const Front> fronts, int k, const TetOptions& options);

}  // namespace sidewall::surface
