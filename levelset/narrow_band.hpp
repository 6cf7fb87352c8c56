#pragma once
#include <memory>

#include "surface/extraction/float_grid.hpp"

namespace sidewall::levelset {

/// Signed distance, world units, negative inside. Active voxels are the narrow band |phi| < kHalfWidth dx; an
/// inactive voxel of an existing leaf holds exactly the background, +-kHalfWidth dx. Only the domain's own
/// nodes are active, and nothing is ever read from tiles: see inside(). Files that read voxels include
/// levelset/openvdb_grid.hpp, which defines the type.
using Grid = surface::FloatGrid;
using GridPtr = std::shared_ptr<Grid>;

/// Half-width of the narrow band in grid spacings: a WENO5 stencil about a voxel at the front fits into it,
/// and so does the Hessian at a node of a cut cell.
inline constexpr double kHalfWidth = 3.0;

/// Nodes nearer to the front than this, in grid spacings, count as on it, whatever sign rounding gives them.
inline constexpr double kOnFront = 1e-4;

}  // namespace sidewall::levelset
