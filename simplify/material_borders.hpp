#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// One flag a vertex: triangles of different `material` meet there. All zero without that attribute.
/// \throws GeometryError if it is not one finite number a triangle.
std::vector<std::uint8_t> material_borders(const TriangleMesh& mesh);

/// One flag a vertex: no collapse may touch it. Material borders, and where \p fixed, one flag a vertex or
/// empty, is set.
/// \throws GeometryError as material_borders does, and if \p fixed has another length than the vertices.
std::vector<std::uint8_t> frozen_vertices(const TriangleMesh& mesh, std::span<const std::uint8_t> fixed);

}  // namespace sidewall::simplify
