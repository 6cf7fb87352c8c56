#pragma once
#include <cstdint>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// One flag a vertex: triangles of different `material` meet there. All zero without that attribute.
/// \throws GeometryError if it is not one finite number a triangle.
std::vector<std::uint8_t> material_borders(const TriangleMesh& mesh);

/// One flag a vertex: no collapse may touch it. Material borders, and where the vertex attribute `fixed` is
/// not zero.
/// \throws GeometryError as material_borders does.
std::vector<std::uint8_t> frozen_vertices(const TriangleMesh& mesh);

}  // namespace sidewall::simplify
