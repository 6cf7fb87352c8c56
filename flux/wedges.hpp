#pragma once
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// Vertices split at creases and material edges. A wedge is a smooth fan of triangle corners of one material
/// around a vertex. A quantity stored by wedge is linear over every triangle, continuous over smooth parts of
/// the surface, and may jump at creases and material edges. Wedges are numbered vertex by vertex.
struct Wedges {
    std::vector<std::uint32_t> corner;  ///< wedge of corner k of triangle t, at 3 t + k
    std::vector<std::uint32_t>
        first;                 ///< wedges of vertex v: first[v] to first[v + 1] - 1 (vertices + 1 entries)
    std::vector<double> area;  ///< a third of the area of the fan's triangles, length unit squared
    std::size_t count() const { return area.size(); }
};

/// A flux and its standard error, by triangle, wedge or vertex. Relative: 1 on an open horizontal plane.
struct FluxField {
    std::vector<double> flux, error;
};

/// Groups the corners of \p mesh into wedges.
///
/// Corners of two triangles that share an edge belong together if the triangles' normals differ by less than
/// \p crease (radian) and their materials are equal.
/// \param materials  one id a triangle, or empty if there is one material.
/// \throws GeometryError if \p materials has another length than the triangles.
/// \note O(n log n) in the largest number of triangles around a vertex; parallel; deterministic.
Wedges make_wedges(const TriangleMesh& mesh, std::span<const std::int32_t> materials = {},
                   double crease = 40.0 * std::numbers::pi / 180.0);

/// Unit normals of the wedges: mean over the fan's triangles, weighted by area.
std::vector<Vec3> wedge_normals(const TriangleMesh& mesh, const Wedges& wedges);

/// Materials of the wedges; 0 for a wedge without triangles.
/// \param materials  one id a triangle, or empty if there is one material, 0.
std::vector<std::int32_t> wedge_materials(const Wedges& wedges, std::span<const std::int32_t> materials);

/// Value of a quantity stored by wedge at a triangle's point with barycentric weights \p u and \p v of its
/// second and third corner.
inline double interpolate(const Wedges& wedges, std::span<const double> values, std::uint32_t triangle,
                          double u, double v) {
    const std::uint32_t* corner = &wedges.corner[3 * std::size_t{triangle}];
    return (1.0 - u - v) * values[corner[0]] + u * values[corner[1]] + v * values[corner[2]];
}

}  // namespace sidewall::flux
