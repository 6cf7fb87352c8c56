#pragma once
#include <cstddef>

#include "surface/triangle_mesh.hpp"

namespace sidewall::test {

/// How many pairs of a mesh's triangles intersect otherwise than in corners and edges that they share, by CGAL.
std::size_t self_intersections(const TriangleMesh& mesh);

}  // namespace sidewall::test
