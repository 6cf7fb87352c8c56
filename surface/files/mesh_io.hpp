#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Reads a triangle mesh; the extension picks the format: .vtp, .ply, .stl or .obj.
///
/// Polygons and strips are split into triangles with their cell's attributes. Numeric attributes of any
/// number of components are kept, strings are not. Vertices that no triangle uses are kept.
///
/// \param metadata  if not null, receives the texts and single numbers of field data, and what was left out.
/// \throws FileError if the file is missing, damaged, of another format, has no triangle, an index out of
///         range or a coordinate that is not finite. The message names the file, the fault and a remedy.
TriangleMesh read_mesh(const std::filesystem::path& path, MeshMetadata* metadata = nullptr);

/// Writes a mesh; the extension picks the format: .vtp, .ply, .stl or .obj. The bytes depend on the arguments
/// alone.
///
/// The file appears under its name only once it is complete. Missing folders are created.
/// \throws FileError for another extension, GeometryError if an attribute has another length than the mesh,
///         IoError if the disk refuses.
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                const MeshMetadata& metadata = {});

/// Adds a list of texts to the metadata, as one text whose items are separated by zero bytes.
void add_list(MeshMetadata& metadata, const std::string& name, const std::vector<std::string>& texts);

/// Names of the attributes that a file of that extension cannot hold: none for VTP and PLY; OBJ keeps only
/// the triangles' `material`, STL only their 16-bit `attribute`.
/// \throws FileError for another extension.
std::vector<std::string> unwritable(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace sidewall::surface
