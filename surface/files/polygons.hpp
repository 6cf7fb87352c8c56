#pragma once
#include <string>
#include <vector>

#include "surface/files/mesh_bytes.hpp"

namespace sidewall::surface {

/// Triangulates the polygons of a file anew where a fan from their first corner would fold over: by ears, in the plane of their
/// vector area. Polygons whose fan is sound, such as convex ones, keep it. The triangles of a cell stay together, as many.
/// \param cells  as add_polygon() made them; all indices lie within \p vertices.
/// \throws FileError naming the file and the place of a polygon that crosses itself, or of over 20,000 corners.
/// \note O(n^2) for a polygon of n corners that is not convex.
void triangulate_polygons(CellTriangles& cells, const std::vector<Vec3>& vertices, const std::string& name);

}  // namespace sidewall::surface
