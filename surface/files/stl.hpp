#pragma once
#include <string>
#include <string_view>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// The file's bytes: binary STL. Coordinates are rounded to single precision; a triangle attribute
/// `attribute` of whole numbers from 0 to 65535 becomes the facets' attribute bytes.
std::string encode_stl(const TriangleMesh& mesh);

/// Reads binary and ascii STL. Corners in the same place become one vertex; facets that this leaves with
/// fewer than three are dropped. Facet normals are not kept, attribute bytes that are not all zero are, as
/// `attribute`.
TriangleMesh decode_stl(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

}  // namespace sidewall::surface
