#pragma once
#include <span>

#include "surface/tetrahedra/tet_complex.hpp"
#include "surface/tetrahedra/tetrahedralize.hpp"

// The stages of tetrahedralize(), in their order; not for others.
namespace sidewall::surface {

/// Tetrahedra of the box, all of the region \p outside, fine where fronts are.
TetComplex bisected_box(std::span<const Front> fronts, const TetOptions& options);

/// Cuts a front into the tetrahedra of region k + 1: those inside it become region k.
void cut_front(TetComplex& mesh, std::span<const Front> fronts, int k, const TetOptions& options);

/// Widens angles below the target.
void improve(TetComplex& mesh, std::span<const Front> fronts, const TetOptions& options);

/// Moves vertices between two materials along their normals, by at most TetOptions::shift and where that leaves no angle
/// under 8 degrees, until every material has the volume asked for.
void match_volumes(TetComplex& mesh, const TetOptions& options);

}  // namespace sidewall::surface
