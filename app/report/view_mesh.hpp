#pragma once
#include <array>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// A mesh as the page draws it, with vertices split at creases and where materials meet.
struct ViewMesh {
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;
    std::vector<int> material;               ///< id of each vertex; empty: no materials
    std::vector<std::vector<float>> values;  ///< by attribute, then vertex; NaN: no value
};

/// How much a mesh is coarsened for the page; lengths in cells of the grid it was extracted from.
struct ViewDetail {
    double max_error = 0.0;   ///< bound on the distance to the saved surface; 0: as saved
    double max_length = 0.0;  ///< longest edge that may collapse
};

/// Coarsens a surface by region-bounded simplification and samples its attributes. A mesh that cannot be
/// simplified stays unchanged.
/// \param attributes  names of scalars on triangles; one that \p mesh lacks is NaN.
/// \param cell        grid spacing that \p mesh was extracted on, world units.
ViewMesh view_mesh(const TriangleMesh& mesh, const std::vector<std::string>& attributes,
                   const ViewDetail& detail, double cell);

/// Coarsens an interface, of which the page shows only sections: positions alone, no split vertices.
ViewMesh bare_view_mesh(const TriangleMesh& mesh, const ViewDetail& detail, double cell);

/// Estimated size in bytes of what encode() makes of a mesh.
std::size_t encoded_size(const ViewMesh& mesh);

/// Encodes a mesh for the page, as {"n": vertices, "p": positions, "i": indices, "wide": indices have 32
/// bits, "m": materials, a byte each, "a": [values of each attribute]}. Numbers are base 64 of little-endian
/// 16 bits: positions in 65535 steps across \p box, values in 65534 steps across \p ranges, 65535 for none.
Json encode(const ViewMesh& mesh, const Box3& box, const std::vector<std::array<double, 2>>& ranges);

/// Encodes bytes in base 64 (RFC 4648).
std::string base64(const std::string& bytes);

/// Makes a surface manifold, as simplification requires. Pairs of triangles with the same three vertices
/// (folds without thickness) are removed. Parts that share only a vertex, or an edge of more than two
/// triangles, each get a copy of it. Of the attributes only the triangles' `material` is kept.
TriangleMesh manifold_parts(const TriangleMesh& mesh);

}  // namespace sidewall::app
