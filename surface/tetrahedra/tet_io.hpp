#pragma once
#include <filesystem>

#include "surface/files/mesh_metadata.hpp"
#include "surface/tetrahedra/tet_mesh.hpp"

namespace sidewall::surface {

/// Writes tetrahedra; the extension picks the format. The bytes depend on the arguments alone.
///
/// .vtu: VTK XML UnstructuredGrid, encoded as by encode_vtp(): the tetrahedra, then the triangles. Cells have
/// the numbers `region` and `boundary` (from 0; -1 for none) and their names, the strings `region_name` and
/// `boundary_name`. The field data `regions` and `boundaries` list all names.
/// .msh: Gmsh's format 2.2 in ASCII, coordinates to the last bit. Boundaries and regions are physical groups.
/// \throws FileError for another extension, IoError if the disk refuses.
void write_tets(const std::filesystem::path& path, const TetMesh& mesh, const MeshMetadata& metadata = {});

/// Writes the triangles and edges of a plane mesh in the formats of write_tets().
/// \throws FileError for another extension, IoError if the disk refuses.
void write_plane(const std::filesystem::path& path, const PlaneMesh& mesh, const MeshMetadata& metadata = {});

/// Writes a VTK multi-block file, and its blocks as VTP in a folder of the same name beside it.
/// \throws IoError if the disk refuses.
void write_vtm(const std::filesystem::path& path,
               const std::vector<std::pair<std::string, const TriangleMesh*>>& blocks,
               const MeshMetadata& metadata = {});

}  // namespace sidewall::surface
