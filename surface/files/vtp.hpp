#pragma once
#include <string>
#include <string_view>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Encodes VTK XML PolyData: appended raw data, zlib compressed, UInt64 headers, little endian; returns the
/// file's bytes. Points are Float64, so that coordinates survive a round trip to the last bit.
std::string encode_vtp(const TriangleMesh& mesh, const MeshMetadata& metadata = {});

/// Reads VTK XML PolyData: ascii, binary or appended (raw, base64) data, zlib compressed or not, either byte
/// order, UInt32 or UInt64 headers, any scalar types, several pieces. \p name names the file in messages.
TriangleMesh decode_vtp(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

}  // namespace sidewall::surface
