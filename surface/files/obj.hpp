#pragma once
#include <string>
#include <string_view>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Encodes Wavefront OBJ; returns the file's bytes. The triangles' `material` N becomes `usemtl material_N`.
std::string encode_obj(const TriangleMesh& mesh);

/// Reads Wavefront OBJ: vertices and polygons. Each material name becomes a value of the triangle attribute
/// `material`: N for the name `material_N`, for all others the lowest unused ids in order of appearance.
/// Normals, texture coordinates, colours, lines and groups are dropped.
TriangleMesh decode_obj(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

}  // namespace sidewall::surface
