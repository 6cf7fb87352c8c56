#pragma once
#include <string>

#include "app/common/json.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

// Output of `sidewall flux` as CSV, VTP, JSON or text.
namespace sidewall::app {

/// Writes a flux on \p mesh as .csv, a row a triangle, or as .vtp with flux, flux_error and area of each
/// triangle, flux and flux_error of each vertex and the mesh's \p metadata.
/// \throws IoError if \p path cannot be written.
void write_flux(const std::string& path, TriangleMesh mesh, const surface::MeshMetadata& metadata,
                const flux::TallyFlux& result);

/// The part of the summary on the calculation: method, rays, times, balance of particles and errors.
Json found_json(const flux::FoundFlux& found);

/// Prints a summary as text.
void print_flux_summary(const Json& json);

}  // namespace sidewall::app
