#pragma once
#include "levelset/grid.hpp"
#include "surface/curvature.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// Curvatures at the vertices of the mesh that extract_surface() made of \p grid: at both grid nodes of a
/// vertex's edge by central differences, then linear along the edge. Goldman, Comput. Aided Geom. Des. 22
/// (2005) 632, equations 3.4 and 4.1; Lenz (2023), section 3.3.
/// \note Parallel. Ghost nodes are read through the domain's sides.
surface::Curvature curvature(const Grid& grid, const Domain& domain, const TriangleMesh& mesh);

}  // namespace sidewall::levelset
