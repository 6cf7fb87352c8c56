#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// What a file says about the whole mesh: units, time, model. VTP keeps it as FieldData, PLY as comments (not
/// read back).
struct MeshMetadata {
    std::vector<std::pair<std::string, std::string>> texts;  ///< e.g. {"length_unit", "um"}
    std::vector<std::pair<std::string, double>> numbers;     ///< e.g. {"time", 5.0}
    /// What the reader had to leave out, in words, e.g. "12 normals". Writers ignore it.
    std::vector<std::string> dropped;
};

/// Reads a triangle mesh; the extension picks the format: .vtp, .ply, .stl or .obj.
///
/// Polygons are split into fans and strips into triangles, each keeping its cell's attributes; scalar
/// attributes of any number of components come along, strings do not. Vertices no triangle uses are kept.
///
/// \param metadata  if not null, receives the file's single-valued field data and what was left out.
/// \throws FileError if the file is missing, damaged, of another kind, has no triangle, an index out of range
/// or a
///         coordinate that is not finite. The message names the file, what is wrong and what to do.
TriangleMesh read_mesh(const std::filesystem::path& path, MeshMetadata* metadata = nullptr);

/// Writes a mesh; the extension picks the format: .vtp, .ply, .stl or .obj. The bytes depend on the arguments
/// alone.
///
/// The file appears under its name only when it is whole. Missing folders are made.
/// \throws FileError for another extension, GeometryError if an attribute has another length than the mesh,
///         IoError if the disk refuses.
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                const MeshMetadata& metadata = {});

/// Names of the attributes that a file of that extension cannot hold: none for VTP and PLY; OBJ keeps only
/// the triangles' `material`, STL only their 16-bit `attribute`.
/// \throws FileError for another extension.
std::vector<std::string> unwritable(const std::filesystem::path& path, const TriangleMesh& mesh);

/// The file's bytes: VTK XML PolyData, appended raw, zlib compressed, UInt64 headers, little endian; points
/// are Float64, so that coordinates survive a round trip to the last bit.
std::string encode_vtp(const TriangleMesh& mesh, const MeshMetadata& metadata = {});

/// Reads VTK XML PolyData: ascii, binary or appended (raw, base64) data, zlib compressed or not, either byte
/// order, UInt32 or UInt64 headers, any scalar types, several pieces. \p name stands for the file in
/// messages.
TriangleMesh decode_vtp(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

/// The file's bytes: binary little-endian PLY, vertices in double. Attributes become properties; those of
/// several components get one property each: `name_0`, `name_1` ...
std::string encode_ply(const TriangleMesh& mesh, const MeshMetadata& metadata = {});

/// Reads ascii and binary PLY. Scalar properties of vertices and faces become attributes, one component each;
/// lists other than the faces' `vertex_indices` are skipped, as are other elements.
TriangleMesh decode_ply(std::string_view bytes, const std::string& name);

/// The file's bytes: binary STL. Coordinates are rounded to single precision; a triangle attribute
/// `attribute` of whole numbers from 0 to 65535 becomes the facets' attribute bytes.
std::string encode_stl(const TriangleMesh& mesh);

/// Reads binary and ascii STL. Corners in the same place become one vertex; facets that this leaves with
/// fewer than three are dropped. Facet normals are not kept, attribute bytes that are not all zero are, as
/// `attribute`.
TriangleMesh decode_stl(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

/// The file's bytes: Wavefront OBJ. The triangles' `material` N becomes `usemtl material_N`.
std::string encode_obj(const TriangleMesh& mesh);

/// Reads Wavefront OBJ: vertices and polygons. Materials become the triangles' `material`: N where they are
/// called `material_N`, else numbered as they come. Normals, texture coordinates, colours, lines and groups
/// are dropped.
TriangleMesh decode_obj(std::string_view bytes, const std::string& name, MeshMetadata* metadata = nullptr);

}  // namespace sidewall::surface
