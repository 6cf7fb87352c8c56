#pragma once
#include "app/models/model.hpp"
#include "app/process/traced_surface.hpp"
#include "levelset/stack.hpp"
#include "surface/mesh_io.hpp"
#include "surface/triangle_mesh.hpp"

// The meshes that a run saves, with their attributes.
namespace sidewall::app {

/// Units, materials and time.
surface::MeshMetadata metadata_of(const Recipe& recipe, double time);

/// The extracted surface with what each triangle's centroid receives and does: material, flux_*, coverage_*,
/// rate; and flux_error_* by vertex if it was itself traced.
TriangleMesh result_mesh(const Model& model, const levelset::MaterialStack& stack,
                         const TracedSurface& surface);

/// The mesh that was traced: material, flux_* and flux_error_* by triangle and vertex, as counted there.
/// \pre the surface was traced.
TriangleMesh traced_mesh(const Model& model, const TracedSurface& surface);

/// The boundary between layer \p k of the stack and what lies above it; no triangles if it is etched away.
TriangleMesh interface_mesh(const levelset::MaterialStack& stack, std::size_t k);

}  // namespace sidewall::app
