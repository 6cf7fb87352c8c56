#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "app/common/json_fwd.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Writes indented JSON to a file, or to standard output if \p path is "-". Non-finite numbers become null.
/// \throws IoError naming the path and the system's reason.
void write_json(const std::string& path, const Json& json);

/// A number, or null where it is not finite, which JSON cannot hold.
/// \param digits  significant ones; those beyond are rounded away.
Json number_or_null(double value, int digits = 17);

/// The numbers of vertices and triangles: {"vertices": ..., "triangles": ...}.
Json mesh_sizes(const TriangleMesh& mesh);

/// The JSON in a file.
/// \throws FileError if the file is missing or no JSON; the message ends with \p advice.
Json read_json(const std::filesystem::path& path, const std::string& advice);

}  // namespace sidewall::app
