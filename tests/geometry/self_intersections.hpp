#pragma once
#include <cstddef>

#include "surface/triangle_mesh.hpp"

namespace sidewall::test {

/// Number of pairs of triangles that intersect elsewhere than in shared corners and edges, counted by CGAL.
std::size_t self_intersections(const TriangleMesh& mesh);

}  // namespace sidewall::test
