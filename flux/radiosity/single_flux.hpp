#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "flux/radiosity/radiosity.hpp"
#include "flux/tracer/tracer.hpp"

// The flux of one species on one surface by either method, as `sidewall flux` and the Python package ask for
// it.
namespace sidewall::flux {

/// What is asked; all references must outlive it.
struct SingleFlux {
    const TriangleMesh& mesh;
    std::span<const std::int32_t> materials;
    const LateralBox& box;
    const Wedges& wedges;
    const surface::RayScene& scene;
    const Species& species;
    TraceOptions options;                    ///< its rays: of paths, or the most to a relative error
    std::optional<double> relative_error{};  ///< instead of that many rays
    bool rays_given = true;  ///< else radiosity without a relative error gathers 64 rays an unknown
};

/// Radiosity, whatever it costs, to the relative error if one is asked for.
MethodChoice as_asked(const SingleFlux& asked);
/// \param exchange  see exchange_of; what it gathers to choose, solve goes on with.
/// \throws as trace_flux.
MethodChoice choose_method(const SingleFlux& asked, Exchange& exchange);

/// By Monte Carlo. \throws as trace_flux.
FluxResult follow(const SingleFlux& asked);

/// Rays between points of the surface, none yet, for solve.
Exchange exchange_of(const SingleFlux& asked);
/// By radiosity on the rays that \p exchange has and gathers. \throws as Exchange::gather and solve_flux.
RadiosityFlux solve(const SingleFlux& asked, const MethodChoice& choice, Exchange& exchange);

}  // namespace sidewall::flux
