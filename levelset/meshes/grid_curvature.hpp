#pragma once
#include "levelset/grid.hpp"
#include "surface/curvature.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// Mean and Gaussian curvature at the vertices of the mesh that extract_surface() made of \p grid. Central
/// differences give the curvatures at both nodes of the grid edge that a vertex lies on; along the edge they
/// are interpolated linearly. Goldman, Comput. Aided Geom. Des. 22 (2005) 632, equations 3.4 and 4.1; Lenz
/// (2023), section 3.3.
/// \note Parallel. Ghost nodes are read through the domain's sides.
surface::Curvature curvature(const Grid& grid, const Domain& domain, const TriangleMesh& mesh);

}  // namespace sidewall::levelset
