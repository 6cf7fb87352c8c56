#pragma once
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "surface/triangle_mesh.hpp"

// Triangles divided at points on their edges, the same for both triangles of an edge.
namespace sidewall::levelset {

/// Vertices to divide edges at, by divided_edge.
using EdgePoints = std::unordered_map<std::uint64_t, std::uint32_t>;

/// Key of the edge between two vertices, in either order.
inline std::uint64_t divided_edge(std::uint32_t a, std::uint32_t b) {
    return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
}

/// By vertex, whether it is an end of a divided edge.
std::vector<std::uint8_t> divided_ends(const TriangleMesh& mesh, const EdgePoints& points);

/// Whether a triangle is surely whole, without looking for its edges: nearly all of them are.
inline bool is_whole(const Triangle& t, const std::vector<std::uint8_t>& ends) {
    return ends[t[0]] + ends[t[1]] + ends[t[2]] < 2;
}

/// The parts of triangle \p t, each oriented as it is: up to four, fewer where one point divides two edges.
std::vector<Triangle> parts_of(const TriangleMesh& mesh, const Triangle& t, const EdgePoints& points);

/// The most triangles that \p whole ones become: a point divides two of them.
inline std::size_t most_parts(std::size_t whole, const EdgePoints& points) {
    return whole + 2 * points.size();
}

/// Makes one of the points on a triangle's edges that lie nearer than \p distance to each other, so that no part between
/// them is without area. It lies on the mesh's boundary if one of them did.
void merge_near(TriangleMesh& mesh, double distance, EdgePoints& points);

/// Leaves out points that would fold the mesh: that would turn a part of a triangle over, so that the normals make an
/// angle whose cosine is below \p least_cosine or the part has no area, or lay a part on its neighbour. On a fold no
/// side of the mesh is its inside (surface::SignedDistance).
void drop_folds(const TriangleMesh& mesh, double least_cosine, EdgePoints& points);

/// The whole mesh with its triangles divided, without vertices that no triangle has; attributes of vertices, of one number each, are 0
/// at points.
TriangleMesh divided(const TriangleMesh& mesh, const EdgePoints& points);

}  // namespace sidewall::levelset
