#pragma once
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "surface/triangle_mesh.hpp"

// Division of triangles at points on their edges; both triangles of an edge share its point.
namespace sidewall::levelset {

/// The vertices that divide edges, by the key of the edge (divided_edge).
using EdgePoints = std::unordered_map<std::uint64_t, std::uint32_t>;

/// Key of the edge between two vertices, in either order.
inline std::uint64_t divided_edge(std::uint32_t a, std::uint32_t b) {
    return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
}

/// By vertex, whether it is an end of a divided edge.
std::vector<std::uint8_t> divided_ends(const TriangleMesh& mesh, const EdgePoints& points);

/// Whether a triangle surely has no divided edge, without a look-up of its edges; true for nearly all.
inline bool is_whole(const Triangle& t, const std::vector<std::uint8_t>& ends) {
    return ends[t[0]] + ends[t[1]] + ends[t[2]] < 2;
}

/// The parts of triangle \p t, oriented like it: up to four, fewer if one point divides two edges.
std::vector<Triangle> parts_of(const TriangleMesh& mesh, const Triangle& t, const EdgePoints& points);

/// Most triangles after the division of \p whole ones: each point divides two.
inline std::size_t most_parts(std::size_t whole, const EdgePoints& points) {
    return whole + 2 * points.size();
}

/// Merges points on a triangle's edges that are nearer than \p distance to each other, so that no part
/// between them has zero area. A merged point lies on the mesh's boundary if one of its points did.
void merge_near(TriangleMesh& mesh, double distance, EdgePoints& points);

/// Removes points that would fold the mesh: those that leave a part of a triangle without area, turn a part
/// over (the cosine between its normal and the triangle's is below \p least_cosine), or lay a part on its
/// neighbour. At a fold the inside of the mesh is undefined (surface::SignedDistance).
void drop_folds(const TriangleMesh& mesh, double least_cosine, EdgePoints& points);

/// The mesh with divided triangles, without unused vertices. Its one-component vertex attributes are 0 at
/// points.
TriangleMesh divided(const TriangleMesh& mesh, const EdgePoints& points);

}  // namespace sidewall::levelset
