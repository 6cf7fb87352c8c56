#pragma once
#include <cstdint>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

inline constexpr std::uint32_t kNoHalfedge = 0xffffffffu;

/// Halfedges of the same triangle.
inline std::uint32_t next_in_triangle(std::uint32_t h) {
    return h % 3 == 2 ? h - 2 : h + 1;
}
inline std::uint32_t previous_in_triangle(std::uint32_t h) {
    return h % 3 == 0 ? h + 2 : h - 1;
}

/// Connectivity of triangles across edges. Halfedge 3 t + k runs from corner k of triangle t to its next corner.
struct Halfedges {
    /// Per halfedge: the same edge in the other triangle, or kNoHalfedge.
    std::vector<std::uint32_t> opposite;
};

/// \throws GeometryError if a coordinate is not finite or beyond 1e50, an index is out of range or a triangle
///         uses a vertex twice.
void check_arrays(const TriangleMesh& mesh);

/// Connects the triangles of an orientable 2-manifold with or without boundary. O(n).
/// \throws GeometryError, naming the place and a remedy, as check_arrays does, and if an edge has more than
///         two triangles, two neighbours are oriented against each other, or triangles at a vertex hang
///         together by that vertex alone.
Halfedges connect(const TriangleMesh& mesh);

}  // namespace sidewall::simplify
