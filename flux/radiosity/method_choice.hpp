#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "flux/radiosity/radiosity.hpp"
#include "flux/species.hpp"
#include "flux/tracer/tracer.hpp"

namespace sidewall::flux {

/// Sticking probability by wedge, from a species' sticking by material.
/// \throws as trace_flux.
std::vector<double> sticking_by_wedge(const Wedges& wedges, std::span<const std::int32_t> materials,
                                      const Species& species);

/// Why radiosity cannot take \p species, for a message, or empty if it can: it must go_on_diffusely from a
/// source that is not tilted.
std::string why_not_radiosity(const Species& species);

/// Gathers until \p exchange has \p rays: a quarter evenly, the others by their adjoint importance for \p species.
/// \throws as Exchange::gather and solve_flux.
void gather_for(std::span<const DiffuseSpecies> species, Exchange& exchange, std::uint64_t rays,
                const SolveOptions& options = {});

/// Share of a target error above which the linear elements alone exceed it: more rays would not help.
inline constexpr double kElementsAlone = 0.9;

/// Gathers until the relative_error of every one of \p species is at most its target, or rays or memory are
/// spent; the results' relative_error shows which. Where the elements' error comes near to the target, more rays do
/// not help: then until the statistical_error is. The solver's tolerance is a two-hundredth of the least target.
/// \param targets    by species, above 0.
/// \param most_rays  to gather in all, those that \p exchange has included.
std::vector<RadiosityFlux> solve_fluxes_to(std::span<const double> targets, Exchange& exchange,
                                           std::span<const DiffuseSpecies> species, std::uint64_t most_rays,
                                           const SolveOptions& options = {});

/// Most rays that `auto` lets radiosity gather, as a multiple of the rays of the paths whose error it is to reach.
constexpr std::uint64_t kMostOfAuto = 4;

/// The method that takes less CPU time to a relative error, as estimated.
struct MethodChoice {
    bool radiosity = false;  ///< takes less from here on, on an exchange whose first rays are kept
    bool viewed = false;     ///< radiosity has no noise, see Exchange::is_viewed: nothing was estimated
    double monte_carlo_cost = 0.0, radiosity_cost = 0.0;  ///< CPU time, in segments of the tracer's
    double spent = 0.0;   ///< cost of the rays gathered to choose, a part of radiosity_cost
    double target = 0.0;  ///< the relative error they are for
    double rays = 0.0;    ///< that radiosity gathers for every unknown; 0 if not estimated
    std::vector<double>
        guess;            ///< flux by wedge from the first rays, to start a solver from; empty without them
    std::string why_not;  ///< why radiosity cannot take the species; empty if it can
};

/// Estimates what both methods take to options.relative_error, or else to the error that the tracer reaches with
/// options.rays, from a few thousand particles of the tracer's and, where those cost more, radiosity's first rays. The
/// same choice on every machine.
/// \param exchange  of the surface and the species' source; gathers the first rays if it has none, and keeps them.
/// \param once      the process traces or solves nothing else, like `sidewall flux`: then radiosity takes longer.
/// \throws as trace_flux.
MethodChoice choose_method(Exchange& exchange, const Species& species,
                           std::span<const std::int32_t> materials, const TraceOptions& options,
                           bool once = false);

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

/// A flux, and how it was found. With radiosity, rays between points stand for particles: the same share of them counts
/// as absorbed or escaped.
struct FoundFlux : FluxResult {
    bool radiosity = false;
    double escaped_fraction = 0.0;       ///< of the particles
    std::optional<MethodChoice> choice;  ///< of `auto`
    // What follows is for radiosity alone.
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
