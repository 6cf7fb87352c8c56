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

/// Metadata with the recipe's units and materials, and the time.
surface::MeshMetadata metadata_of(const Recipe& recipe, double time);

/// Whether a mesh with this metadata is the profile of an axial wafer rather than its surface.
bool is_round_profile(const surface::MeshMetadata& metadata);

/// The extracted surface, divided where materials meet. By triangle, at its centroid: material, flux_*,
/// coverage_*, rate. By vertex, if this mesh itself was traced: flux_error_*.
/// \param cut  from extract_materials.
TriangleMesh result_mesh(const Model& model, const levelset::MaterialStack& stack,
                         const TracedSurface& surface, levelset::CutMesh cut);

/// The mesh that was traced, with material, and flux_* and flux_error_* as counted by triangle and by vertex.
/// \pre the surface was traced.
TriangleMesh traced_mesh(const Model& model, const TracedSurface& surface);

/// The boundary between a layer and what lies above it, with its material; empty if the layer is etched away.
TriangleMesh interface_mesh(TriangleMesh mesh, int material);

// Wafers of a run's folder, to be drawn and measured.
/// A wafer as a result that belongs to no file: surface and interfaces with materials, units and time.
Result wafer_result(const Recipe& recipe, const levelset::MaterialStack& stack, double time);

/// The wafer in a folder's checkpoint as a result: surface and interfaces with their materials.
/// \returns nothing if there is no checkpoint, or a surface of its time or later has been saved.
/// \throws FileError, RecipeError if the checkpoint or the recipe beside it is damaged.
std::optional<Result> wafer_of_checkpoint(const std::filesystem::path& folder);

/// Measures a wafer that a folder's run has saved, or that of its checkpoint.
/// \param recipe  of the folder (load_frame); its [metrology] says what to measure.
/// \param saved   one of the folder's surfaces; none: the checkpoint's wafer (of a finished run: at its end).
/// \param anew    measure by \p recipe; else return the figures that the run recorded at the end of a step.
/// \note Rebuilds a saved wafer from its surface and interfaces, which rounds sharp edges within a cell.
/// \throws FileError if the checkpoint is missing or damaged.
std::vector<Measure> measure_saved(const std::filesystem::path& folder, const Recipe& recipe,
                                   const std::optional<SavedSurface>& saved, bool anew);

}  // namespace sidewall::app
