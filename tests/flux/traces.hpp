#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "flux/lateral.hpp"
#include "flux/tracer/tracer.hpp"
#include "surface/triangle_mesh.hpp"

// How the flux tests trace and average.
namespace sidewall::flux {

FluxResult trace(const TriangleMesh& mesh, std::array<Boundary, 2> boundary, const Species& species,
                 const TraceOptions& options, std::span<const std::int32_t> materials = {});

/// Checks that every particle is absorbed or escapes, none leaks, and the ledgers add up.
void check_balance(const FluxResult& result);

/// Mean flux over some triangles and its standard error, with the triangles' counts taken as independent.
struct Mean {
    double flux = 0.0, error = 0.0;
};

Mean mean_flux(const TriangleMesh& mesh, const FluxResult& result,
               const std::function<bool(std::size_t)>& chosen);

}  // namespace sidewall::flux
