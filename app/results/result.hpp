#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "app/schema/materials.hpp"
#include "surface/mesh_io.hpp"

namespace sidewall::app {

/// A file that a surface.pvd lists.
struct PvdEntry {
    double time = 0.0;
    std::filesystem::path file;  ///< the collection's folder included
};

/// The files of a ParaView collection, in its order.
/// \throws FileError if it is missing or lists none.
std::vector<PvdEntry> read_pvd(const std::filesystem::path& path);

/// What `inspect` and `render` look at: a mesh file, or the last state in a folder that `run` wrote.
struct Result {
    std::filesystem::path source;  ///< the mesh file the surface came from
    TriangleMesh surface;
    std::vector<TriangleMesh> interfaces;         ///< between materials, bottom up; empty for a mesh file
    surface::MeshMetadata metadata;               ///< of the surface: units, time
    std::optional<std::filesystem::path> folder;  ///< set if a folder was named
    std::optional<Json> summary;                  ///< the folder's summary.json, if the run has ended
};

/// Reads a mesh file, or the last surface_* that DIR/surface.pvd lists, with the interface_* of that time.
/// \throws FileError naming what is missing or damaged.
Result read_result(const std::filesystem::path& path);

/// DIR/summary.json of a run that has ended.
/// \throws FileError if it is missing or no JSON.
Json read_summary(const std::filesystem::path& folder);

/// A text of the metadata, or \p otherwise.
std::string metadata_text(const surface::MeshMetadata& metadata, const std::string& name,
                          const std::string& otherwise);

/// Names and colours by id: from the metadata's `materials` and `material_colours` (comma separated) where a
/// file has them, else the built-in table.
Materials materials_of(const surface::MeshMetadata& metadata);

}  // namespace sidewall::app
