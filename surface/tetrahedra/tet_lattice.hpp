#pragma once
#include <span>

#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Tetrahedra of the box, all of the region \p outside, fine where fronts are.
TetComplex bisected_box(std::span<const Front> fronts, const TetOptions& options);

}  // namespace sidewall::surface
