#pragma once
#include <string>
#include <string_view>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Encodes binary little-endian PLY with vertices in double; returns the file's bytes. Attributes become
/// properties, those of several components one property each: `name_0`, `name_1` ...
std::string encode_ply(const TriangleMesh& mesh, const MeshMetadata& metadata = {});

/// Reads ascii and binary PLY. Scalar properties of vertices and faces become attributes of one component.
/// All lists but the faces' `vertex_indices` are skipped, as are other elements.
TriangleMesh decode_ply(std::string_view bytes, const std::string& name);

}  // namespace sidewall::surface
