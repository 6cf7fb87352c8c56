#pragma once
#include <string>
#include <vector>

#include "surface/files/mesh_bytes.hpp"

namespace sidewall::surface {

/// Triangulates those polygons of a file anew whose fan from the first corner folds over, by ear clipping in
/// the plane of their vector area. Polygons with a valid fan, such as convex ones, keep it. Each cell keeps
/// the number and position of its triangles.
/// \param cells  as add_polygon() made them. Polygons with indices beyond \p vertices are left as they came.
/// \throws FileError with the place of a polygon that crosses itself, or of a concave one of over 20,000
///         corners.
/// \note O(n^2) for a polygon of n corners that is not convex.
void triangulate_polygons(CellTriangles& cells, const std::vector<Vec3>& vertices, const std::string& name);

}  // namespace sidewall::surface
