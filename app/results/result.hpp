#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/common/json.hpp"
#include "app/schema/keys.hpp"
#include "surface/files/mesh_io.hpp"

namespace sidewall::app {

/// A surface that a run saved.
struct SavedSurface {
    std::size_t number = 0;  ///< NNNN of surface_NNNN.vtp
    double time = 0.0;       ///< process time
    std::filesystem::path file;
    std::string after;  ///< label of the step that ended then; empty within a step
    std::vector<std::filesystem::path> interfaces = {};  ///< files of the same number, bottom up
};

/// The surfaces that DIR/surface.pvd lists, in its order.
/// \throws FileError if there is none or the list is damaged.
std::vector<SavedSurface> saved_surfaces(const std::filesystem::path& folder);

/// The surface nearest to \p time; if several have the same time, the last of them.
/// \pre there is one. \throws RecipeError, naming --time, if none was saved before or after \p time.
const SavedSurface& saved_at(const std::vector<SavedSurface>& saved, double time);

/// The surface at the end of a step; for a step in a loop, of the last cycle that was saved.
/// \param step  its name in the recipe, such as etch, its number, such as 2 or 2.1, or both as in reports.
/// \throws RecipeError, naming --step and the steps whose end was saved.
const SavedSurface& saved_after(const std::vector<SavedSurface>& saved, const std::string& step);

/// The surface with that number in its file's name.
/// \throws RecipeError, naming --frame and the numbers there are.
const SavedSurface& saved_number(const std::vector<SavedSurface>& saved, long long number);

/// The input of `inspect` and `render`: a mesh file, or one state in a folder that `run` wrote.
struct Result {
    std::filesystem::path source;  ///< the mesh file the surface came from
    TriangleMesh surface;
    std::vector<TriangleMesh> interfaces;         ///< between materials, bottom up; empty for a mesh file
    surface::MeshMetadata metadata;               ///< of the surface: units, time
    std::optional<std::filesystem::path> folder;  ///< set if a folder was named
    std::optional<Json> summary;                  ///< the folder's summary.json, if the run has ended
};

/// Reads a mesh file, or from a folder its latest surface in DIR/surface.pvd, the interfaces and the summary.
/// \throws FileError naming what is missing or damaged.
Result read_result(const std::filesystem::path& path);

/// Reads one of a folder's surfaces with its interfaces; no summary.
/// \throws FileError naming what is missing or damaged.
Result read_saved(const std::filesystem::path& folder, const SavedSurface& saved);

/// The interface_NNNN_K.vtp that lie beside a file surface_NNNN.vtp, by K; none beside any other file.
/// \throws FileError if one is damaged.
std::vector<TriangleMesh> interfaces_beside(const std::filesystem::path& surface);

/// DIR/summary.json of a run that has ended.
/// \throws FileError if it is missing or no JSON.
Json read_summary(const std::filesystem::path& folder);

/// A text of the metadata, with control characters escaped; \p otherwise if it has none of that name.
std::string metadata_text(const surface::MeshMetadata& metadata, const std::string& name,
                          const std::string& otherwise);

/// A number of the metadata, such as "time"; none if it has none of that name.
std::optional<double> metadata_number(const surface::MeshMetadata& metadata, const std::string& name);

/// Names and colours by id: from the metadata's lists `materials` and `material_colours` where a file has
/// them, else the built-in table. Control characters in them become `\xNN`.
Materials materials_of(const surface::MeshMetadata& metadata);

/// A figure of a summary's metrology; NaN if it has none of that name.
double figure_of(const Json& summary, const std::string& name);

/// Whether a summary was written by another version of the program.
bool has_other_version(const Json& summary);

/// Checks a summary read from \p folder. \throws FileError naming an entry that it lacks.
void require_whole(const Json& summary, const std::filesystem::path& folder);

/// DIR/summary.json if it exists, lacks nothing and is of this version.
std::optional<Json> own_summary(const std::filesystem::path& folder);

/// DIR/summary.json of a run that has ended.
/// \throws FileError if it is missing, no JSON, or lacks anything.
Json read_whole_summary(const std::filesystem::path& folder);

}  // namespace sidewall::app
