#pragma once
#include <filesystem>

#include "surface/files/mesh_metadata.hpp"
#include "surface/tetrahedra/tet_mesh.hpp"

namespace sidewall::surface {

/// Writes tetrahedra; the extension picks the format. The bytes depend on the arguments alone.
///
/// .vtu: VTK XML UnstructuredGrid, as encode_vtp writes: the tetrahedra, then the triangles. Cells have `region` and
/// `boundary`, numbers from 0 and -1 for what is none, and the names that these stand for as strings, `region_name` and
/// `boundary_name`; the lists of names are field data `regions` and `boundaries`.
/// .msh: Gmsh's format 2.2 in ASCII, numbers to the last bit. Boundaries and regions are physical groups.
/// \throws FileError for another extension, IoError if the disk refuses.
void write_tets(const std::filesystem::path& path, const TetMesh& mesh, const MeshMetadata& metadata = {});

/// Writes triangles of a plane with their edges, as write_tets does tetrahedra with their faces.
/// \throws FileError for another extension, IoError if the disk refuses.
void write_plane(const std::filesystem::path& path, const PlaneMesh& mesh, const MeshMetadata& metadata = {});

/// A multi-block file, and its blocks as VTP in a folder of its name beside it.
/// \throws IoError if the disk refuses.
void write_vtm(const std::filesystem::path& path,
               const std::vector<std::pair<std::string, const TriangleMesh*>>& blocks,
               const MeshMetadata& metadata = {});

}  // namespace sidewall::surface
