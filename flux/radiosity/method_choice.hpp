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

/// Sticking probability by wedge, from the sticking by material of a species.
/// \throws as trace_flux.
std::vector<double> sticking_by_wedge(const Wedges& wedges, std::span<const std::int32_t> materials,
                                      const Species& species);

/// Why radiosity cannot take \p species, for a message; empty if it can: a species re-emitted diffusely, from
/// an untilted cos^n source, without energy, yields or collisions in the gas.
std::string why_not_radiosity(const Species& species);

/// Gathers until \p exchange has \p rays: a quarter started evenly, the others by importance for \p species.
/// \throws as Exchange::gather and solve_flux.
void gather_for(std::span<const DiffuseSpecies> species, Exchange& exchange, std::uint64_t rays,
                const SolveOptions& options = {});

/// Share of a target error above which the elements' error counts as exceeding it: more rays would not help.
inline constexpr double kDiscretisationShare = 0.9;

/// Gathers until the relative_error of every species is at most its target, or rays or memory are spent; the
/// results' relative_error shows which. If the elements' error is kDiscretisationShare of a target or more, only
/// the statistical_error has to meet it. The solver's tolerance is a two-hundredth of the least target.
/// \param targets    relative errors by species, above 0.
/// \param most_rays  limit for all rays of \p exchange, including those that it already has.
std::vector<RadiosityFlux> solve_fluxes_to(std::span<const double> targets, Exchange& exchange,
                                           std::span<const DiffuseSpecies> species, std::uint64_t most_rays,
                                           const SolveOptions& options = {});

/// Most rays that `auto` lets radiosity gather, as a multiple of Monte Carlo's rays for the same error.
constexpr std::uint64_t kMostOfAuto = 4;

/// The method estimated to take less CPU time to a relative error.
struct MethodChoice {
    bool radiosity = false;  ///< radiosity costs less, not counting the first rays, which its exchange keeps
    bool viewed = false;     ///< radiosity has no noise, see Exchange::is_viewed: nothing was estimated
    double monte_carlo_cost = 0.0, radiosity_cost = 0.0;  ///< CPU time, in segments of the tracer
    double spent = 0.0;         ///< cost of the first rays, a part of radiosity_cost
    double target = 0.0;        ///< relative error for which radiosity_cost is estimated
    double paths_target = 0.0;  ///< relative error for which monte_carlo_cost is estimated
    double rays = 0.0;          ///< rays an unknown that radiosity gathers; 0 if not estimated
    std::vector<double> guess;  ///< flux by wedge from the first rays, to start a solver; empty without them
    std::string why_not;        ///< why radiosity cannot take the species; empty if it can
};

/// Estimates the costs of both methods for options.relative_error, or else for the error of Monte Carlo with
/// options.rays. On a surface of revolution Monte Carlo's cost is that of half the error. Traces a few thousand
/// particles; if Monte Carlo then seems to cost more than radiosity's first rays, gathers these. The choice does
/// not depend on the machine.
/// \param exchange  of the surface and the source; keeps the first rays, or uses those that it has.
/// \param once      whether the process solves only this, like `sidewall flux`: radiosity then costs more.
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
    TraceOptions options;    ///< `rays` is their number, or with a relative error the most
    bool rays_given = true;  ///< false: radiosity without a relative error gathers 64 rays an unknown
};

/// An exchange for choose_method and solve, without rays yet.
Exchange exchange_of(const SingleFlux& asked);
/// Solves by radiosity, gathering the rays that \p exchange lacks.
/// \throws as Exchange::gather and solve_flux.
RadiosityFlux solve(const SingleFlux& asked, const MethodChoice& choice, Exchange& exchange);

/// A flux, and how it was found. With radiosity, the particle counts are those of the rays gathered, of which
/// the absorbed share of the solution counts as absorbed, the rest as escaped.
struct FoundFlux : FluxResult {
    bool radiosity = false;
    double escaped_fraction = 0.0;       ///< share of the particles that escape
    std::optional<MethodChoice> choice;  ///< the choice of `auto`
    // The following members are for radiosity only.
    double solve_seconds = 0.0;  ///< time of the solve, a part of `seconds`
    std::size_t unknowns = 0;
    std::uint64_t samples = 0, residual_rays = 0;
    std::uint32_t iterations = 0;
    double statistical_error = 0.0;
};

/// Finds a flux by `monte-carlo`, `radiosity` or `auto`, which takes the cheaper of both.
/// \param chosen  called with the choice of `auto` once it is made; may be empty.
/// \throws as trace_flux, Exchange::gather and solve_flux.
FoundFlux find_flux(const std::string& method, const SingleFlux& asked,
                    const std::function<void(const MethodChoice&)>& chosen = {});

}  // namespace sidewall::flux
