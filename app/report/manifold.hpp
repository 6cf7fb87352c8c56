#pragma once
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Makes a surface manifold, as simplification requires: pairs of triangles with the same three vertices (a fold of
/// no thickness) go, and parts that share only a vertex, or an edge of more than two triangles, get their own copies
/// of it. Keeps no attribute but the triangles' `material`.
TriangleMesh manifold_parts(const TriangleMesh& mesh);

}  // namespace sidewall::app
