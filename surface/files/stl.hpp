#pragma once
#include <string>
#include <string_view>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Encodes binary STL; returns the file's bytes. Coordinates are rounded to single precision. A triangle
/// attribute `attribute` of whole numbers from 0 to 65535 becomes the facets' attribute bytes.
std::string encode_stl(const TriangleMesh& mesh);

/// Reads binary and ascii STL. Corners in the same place become one vertex; facets left with fewer than three
/// vertices are dropped. Facet normals are not kept. Attribute bytes become the triangle attribute
/// `attribute` unless all are zero.
TriangleMesh decode_stl(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

}  // namespace sidewall::surface
