#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "levelset/meshes/fronts.hpp"
#include "surface/triangle_mesh.hpp"

// Covers: heights of a mesh's vertices above the fronts of lower layers.
namespace sidewall::levelset {

/// The cover of a vertex on a sharp edge along which a lower layer comes out: the layer is covered on one
/// side of the edge and bare on the other. The vertex counts as bare, and no mesh edge is divided beside it.
inline constexpr double kOnLine = -std::numeric_limits<double>::min();

/// By layer below \p of and vertex of its mesh: the height in cells (dx) above the layer's continued front,
/// positive where the material between is exposed. Vertices on sharp edges get it from those around.
std::vector<std::vector<double>> heights_above_fronts(const Fronts& fronts, std::size_t of,
                                                      const TriangleMesh& mesh);

/// By vertex: whether it lies on a sharp edge or a corner of the mesh.
std::vector<std::uint8_t> on_edges(const TriangleMesh& mesh);

/// Calls use(vertex, other) for every marked vertex and each unmarked one that follows it in a triangle.
template <class Use>
void each_around(const TriangleMesh& mesh, const std::vector<std::uint8_t>& marked, Use&& use) {
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            if (marked[t[k]] && !marked[t[(k + 1) % 3]]) use(t[k], t[(k + 1) % 3]);
}

}  // namespace sidewall::levelset
