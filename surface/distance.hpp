#pragma once
#include <vector>

#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Distances from the vertices of one mesh to the surface of another, in the meshes' length unit.
struct Distance {
    double max = 0.0;
    double mean = 0.0;  ///< over the vertices, each counting the same
    std::vector<double> per_vertex;
};

/// Distance from every vertex of \p from to the nearest point of \p to, found in parallel and computed in
/// double precision; the sum runs in vertex order, so that the result does not depend on threads. Vertices
/// that no triangle uses are not on the surface: their distance is 0 and does not count. A mesh without
/// triangles is its points.
///
/// \throws GeometryError if \p from has no vertex or \p to no triangle.
/// \note Each search starts from the nearest point of the vertex before: cheap if vertices lie in spatial
/// order.
Distance distance(const TriangleMesh& from, const TriangleMesh& to);

/// distance() with the hierarchy of \p to at hand.
Distance distance(const TriangleMesh& from, const RayScene& to);

/// Both directions between two surfaces.
struct TwoSidedDistance {
    Distance forward;   ///< vertices of the first mesh to the surface of the second
    Distance backward;  ///< and the other way round
    double max = 0.0;   ///< greater of the two maxima: the Hausdorff distance sampled at vertices
    double mean = 0.0;  ///< greater of the two means
};

TwoSidedDistance two_sided_distance(const TriangleMesh& first, const TriangleMesh& second);

}  // namespace sidewall::surface
