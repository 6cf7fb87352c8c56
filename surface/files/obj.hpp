#pragma once
#include <string>
#include <string_view>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// The file's bytes: Wavefront OBJ. The triangles' `material` N becomes `usemtl material_N`.
std::string encode_obj(const TriangleMesh& mesh);

/// Reads Wavefront OBJ: vertices and polygons. Each material's name gives its faces an id of its own, their triangles'
/// `material`: N to `material_N`, to all other names the lowest ids that are left, in the order in which they come. Normals,
/// texture coordinates, colours, lines and groups are dropped.
TriangleMesh decode_obj(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

}  // namespace sidewall::surface
