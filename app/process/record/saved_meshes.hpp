#pragma once
#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/meshes/contact_lines.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/triangle_mesh.hpp"

// The meshes that a run saves, with their attributes.
namespace sidewall::app {

/// Units, materials and time.
surface::MeshMetadata metadata_of(const Recipe& recipe, double time);

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

}  // namespace sidewall::app
