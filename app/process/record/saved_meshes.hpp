#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "app/results/metrology.hpp"
#include "app/results/result.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/meshes/contact_lines.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/triangle_mesh.hpp"

// The meshes that a run saves, with their attributes.
namespace sidewall::app {

/// Units, materials and time.
surface::MeshMetadata metadata_of(const Recipe& recipe, double time);

/// Whether a mesh with this metadata is the profile of a round wafer, and no surface.
bool is_round_profile(const surface::MeshMetadata& metadata);

/// The extracted surface, divided where materials meet, with what each triangle's centroid receives and does: material,
/// flux_*, coverage_*, rate; and flux_error_* by vertex if it was itself traced.
/// \param cut  of extract_materials.
TriangleMesh result_mesh(const Model& model, const levelset::MaterialStack& stack,
                         const TracedSurface& surface, levelset::CutMesh cut);

/// The mesh that was traced: material, flux_* and flux_error_* by triangle and vertex, as counted there.
/// \pre the surface was traced.
TriangleMesh traced_mesh(const Model& model, const TracedSurface& surface);

/// The boundary between a layer and what lies above it, with its material; no triangles if the layer is etched away.
TriangleMesh interface_mesh(TriangleMesh mesh, int material);

// Wafers of a run's folder, to be drawn and measured.
/// A wafer as a result: surface and interfaces with their materials, units and time; of no file.
Result wafer_result(const Recipe& recipe, const levelset::MaterialStack& stack, double time);

/// The wafer of a folder's checkpoint as a result: surface and interfaces with their materials.
/// \returns nothing if there is no checkpoint, or a surface of its time or a later one has been saved.
/// \throws FileError, RecipeError if it is damaged, or the recipe beside it.
std::optional<Result> wafer_of_checkpoint(const std::filesystem::path& folder);

/// Measures one of the wafers that a folder's run has saved, or that of its checkpoint.
/// \param recipe  whose [metrology] says what is measured; of the folder (load_frame).
/// \param saved   of the folder's surfaces; none: the checkpoint's wafer, which is that of the end of a finished run.
/// \param anew    measure what the recipe says; else give the figures that the run found where it ended a step.
/// \note A saved wafer is made anew from its surface and interfaces, which rounds sharp edges within their cell.
/// \throws FileError if the checkpoint is missing or damaged.
std::vector<Measure> measure_saved(const std::filesystem::path& folder, const Recipe& recipe,
                                   const std::optional<SavedSurface>& saved, bool anew);

}  // namespace sidewall::app
