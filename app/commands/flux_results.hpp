#pragma once
#include <string>

#include "app/common/json.hpp"
#include "flux/radiosity/radiosity.hpp"
#include "flux/tracer/tracer.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Writes a flux on \p mesh: .csv, a row a triangle, or .vtp, per triangle flux, flux_error and area, and per
/// vertex flux and flux_error.
/// \throws IoError if \p path cannot be written.
void write_flux(const std::string& path, TriangleMesh mesh, const flux::TallyFlux& result);

/// What the summary of `sidewall flux` holds of each method.
Json traced_json(const flux::FluxResult& result);
Json solved_json(const flux::Exchange& exchange, const flux::RadiosityFlux& result);

/// Prints a whole summary for people.
void print_summary(const Json& json);

}  // namespace sidewall::app
