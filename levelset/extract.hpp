#pragma once
#include "levelset/grid.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// The front of \p grid as a mesh that ends exactly on the domain's sides (surface/marching_cubes.hpp),
/// periodic sides included; empty if there is no front.
TriangleMesh extract_surface(const Grid& grid, const Domain& domain);

}  // namespace sidewall::levelset
