#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// Flags vertices that no collapse may touch: where triangles of different `material` meet, and where \p fixed, one flag a
/// vertex or empty, is set.
/// \throws GeometryError if `material` is not one finite number a triangle or \p fixed has another length than the vertices.
std::vector<std::uint8_t> frozen_vertices(const TriangleMesh& mesh, std::span<const std::uint8_t> fixed);

}  // namespace sidewall::simplify
