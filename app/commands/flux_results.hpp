#pragma once
#include <string>

#include "app/common/json.hpp"
#include "flux/radiosity/radiosity.hpp"
#include "flux/tracer/tracer.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// Writes a flux on \p mesh as .csv, a row a triangle, or as .vtp with flux, flux_error and area of each triangle and
/// flux and flux_error of each vertex.
/// \throws IoError if \p path cannot be written.
void write_flux(const std::string& path, TriangleMesh mesh, const flux::TallyFlux& result);

/// Summaries of `sidewall flux` by Monte Carlo and by radiosity.
Json traced_json(const flux::FluxResult& result);
Json solved_json(const flux::Exchange& exchange, const flux::RadiosityFlux& result);

/// Prints a summary as text.
void print_flux_summary(const Json& json);

}  // namespace sidewall::app
