#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "flux/radiosity/exchange.hpp"
#include "flux/tracer/tracer.hpp"

// Radiosity: fluxes of particles that re-emit diffusely, by solving their balance on the surface:
//
//     Gamma = E + F (1 - s) Gamma
//
// The flux Gamma is linear over every triangle, see Wedges; E comes directly from the source. The exchange F
// does not depend on the sticking s: rays between points of the surface are traced once, and every species,
// sticking and coverage then takes a solve without tracing. A ray joins its ends both ways, so that the
// exchange is symmetric (reciprocity). A closed cavity without sticking gets flux 1 exactly, and noise
// changes the flux on a deep floor by products of two small differences only (exchange_samples.hpp).
namespace sidewall::flux {

/// One species to solve for. Spans hold one value a wedge.
struct DiffuseSpecies {
    std::string name = "neutral";        ///< for messages
    double source_exponent = 1.0;        ///< n of the cos^n source: one of those the exchange was made for
    double source = 1.0;                 ///< flux on an open horizontal plane; 0 if nothing comes from above
    std::span<const double> sticking{};  ///< in [0, 1], see sticking_by_wedge
    /// Diffuse emission from the surface besides re-emission (sputtered, desorbed): a flux in the units of
    /// the result, at least 0; empty if there is none. It counts as an arrival only where it lands.
    std::span<const double> emission{};
    std::span<const double> guess{};  ///< flux to start the solver from, e.g. of the last coverage iteration
};

struct SolveOptions {
    /// The solver stops when one more relaxation would change the unknowns by less than this in the mean,
    /// each relative to itself, or to 1e-7 of the largest direct flux if that is more.
    double tolerance = 1e-5;
    std::uint32_t most_iterations = 2000;
    bool errors = true;          ///< estimates errors, for about twice as much time; false leaves them 0
    std::uint32_t halvings = 3;  ///< halvings of the rays for errors, 1 to 3; errors of fewer scatter more
    bool unbiased = true;        ///< subtracts the bias estimated from halves of the rays; free with errors
    /// Targets of solve_fluxes_to bound statistical errors alone, e.g. to compare methods on one mesh.
    bool of_rays = false;
    std::function<bool()> stop{};  ///< asked in every iteration; true ends the solve with Interrupted
};

/// A solved flux, per triangle, wedge and vertex like the tracer's (TallyFlux).
struct RadiosityFlux : TallyFlux {
    double relative_error = 0.0;  ///< root of the sum of the squares of the next two; 0 without errors
    /// Error of the rays: sum(area * standard error) / sum(area * flux), over vertices whose flux depends on rays.
    double statistical_error = 0.0;
    /// Error of the linear elements: sum(area * rms error) / sum(area * flux) over triangles (residual.hpp),
    /// together with that of the absorption where sticking varies over an element.
    double discretisation_error = 0.0;
    double absorbed = 0.0, escaped = 0.0;  ///< shares of all that source and surface emit; their sum is 1
    std::uint32_t iterations = 0;          ///< iterations of the solver, without those for the errors
    double seconds = 0.0;                  ///< wall time of the solve
};

/// Solves for the flux of \p species on the rays gathered so far. Traces no ray.
///
/// The estimate is consistent, not unbiased: its bias falls as 1/rays, and the bias estimated from halves of
/// the rays is subtracted. Standard errors come from differences between halves, for `halvings` halvings.
/// \throws RecipeError for values out of range or an exponent that was not gathered, GeometryError for arrays
///         that do not fit, Interrupted, NumericsError with the reason if the balance has no solution
///         (nothing sticks and nothing escapes) or the solver does not converge.
RadiosityFlux solve_flux(const Exchange& exchange, const DiffuseSpecies& species,
                         const SolveOptions& options = {});

}  // namespace sidewall::flux
