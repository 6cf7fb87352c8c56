#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

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

/// An exchange for choose_method and solve, without rays yet.
Exchange exchange_of(const SingleFlux& asked);
/// By radiosity on the rays that \p exchange has and gathers. \throws as Exchange::gather and solve_flux.
RadiosityFlux solve(const SingleFlux& asked, const MethodChoice& choice, Exchange& exchange);

/// A flux, and how it was found. Of radiosity, rays between points stand for particles: as large a share of them counts as
/// absorbed or escaped.
struct FoundFlux : FluxResult {
    bool radiosity = false;
    double escaped_fraction = 0.0;       ///< of the particles
    std::optional<MethodChoice> choice;  ///< of `auto`
    // Of radiosity alone:
    double solve_seconds = 0.0;  ///< a part of `seconds`
    std::size_t unknowns = 0;
    std::uint64_t samples = 0, residual_rays = 0;
    std::uint32_t iterations = 0;
    double statistical_error = 0.0;
};

/// Finds a flux by `monte-carlo`, `radiosity` or `auto`, which takes the one that costs less.
/// \param chosen  called with the choice of `auto` once it is made; may be empty.
/// \throws as trace_flux, Exchange::gather and solve_flux.
FoundFlux find_flux(const std::string& method, const SingleFlux& asked,
                    const std::function<void(const MethodChoice&)>& chosen = {});

}  // namespace sidewall::flux
