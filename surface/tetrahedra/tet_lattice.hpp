#pragma once
#include <span>

#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tet_options.hpp"

namespace sidewall::surface {

/// Tetrahedra that fill the box, fine near fronts, all in the region TetComplex::outside.
TetComplex bisected_box(std::span<const Front> fronts, const TetOptions& options);

}  // namespace sidewall::surface
