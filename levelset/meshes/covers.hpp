#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "levelset/meshes/fronts.hpp"
#include "surface/triangle_mesh.hpp"

// How far a mesh's vertices lie above the layers below it.
namespace sidewall::levelset {

/// The cover of a vertex on an edge of the mesh along which a layer comes out: what lies on one side of the edge is covered, what
/// lies on the other is bare. It counts as bare, and no edge of the mesh is divided beside it.
inline constexpr double kOnLine = -std::numeric_limits<double>::min();

/// By layer below \p of and vertex of its mesh: the height in cells above the layer's continued front, positive where what lies
/// between the two is exposed. Vertices on edges of the mesh have what those around have.
std::vector<std::vector<double>> covers_of(const Fronts& fronts, std::size_t of, const TriangleMesh& mesh);

/// By vertex: whether it lies on an edge or a corner of the mesh.
std::vector<std::uint8_t> on_edges(const TriangleMesh& mesh);

/// Calls use(vertex, other) for every vertex that is marked and each that follows it around a triangle.
template <class Use>
void each_around(const TriangleMesh& mesh, const std::vector<std::uint8_t>& marked, Use&& use) {
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            if (marked[t[k]] && !marked[t[(k + 1) % 3]]) use(t[k], t[(k + 1) % 3]);
}

}  // namespace sidewall::levelset
