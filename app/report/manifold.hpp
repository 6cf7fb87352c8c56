#pragma once
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The same surface for simplification, which asks for a manifold: triangles of the same three vertices cancel in pairs
/// (a fold of no thickness, whatever side counts as inside), and parts that hang together by a vertex or an edge of
/// more than two triangles get their own copies of it. Keeps the triangles' `material` alone.
TriangleMesh manifold_parts(const TriangleMesh& mesh);

}  // namespace sidewall::app
