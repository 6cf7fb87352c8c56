#pragma once
#include <cstdint>
#include <span>

#include "flux/radiosity/method_choice.hpp"

// The flux of one species on one surface by either method, as `sidewall flux` and the Python package need it.
namespace sidewall::flux {

/// A flux to be found; all references must outlive it.
struct SingleFlux {
    const TriangleMesh& mesh;
    std::span<const std::int32_t> materials;
    const LateralBox& box;
    const Wedges& wedges;
    const surface::RayScene& scene;
    const Species& species;
    TraceOptions options;    ///< its rays: of paths, or the most to its relative error
    bool rays_given = true;  ///< else radiosity without a relative error gathers 64 rays an unknown
};

/// Radiosity, whatever it costs, to the relative error if one is asked for.
MethodChoice as_asked(const SingleFlux& asked);
/// By Monte Carlo. \throws as trace_flux.
FluxResult follow(const SingleFlux& asked);

/// An exchange for choose_method and solve, without rays yet.
Exchange exchange_of(const SingleFlux& asked);
/// By radiosity on the rays that \p exchange has and gathers. \throws as Exchange::gather and solve_flux.
RadiosityFlux solve(const SingleFlux& asked, const MethodChoice& choice, Exchange& exchange);

}  // namespace sidewall::flux
