#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "flux/radiosity/exchange.hpp"
#include "flux/tracer/tracer.hpp"

// Fluxes of particles that re-emit diffusely, by solving their balance on the surface instead of following
// them:
//
//     Gamma = E + F (1 - s) Gamma
//
// The flux Gamma is linear over every triangle, see Wedges. The exchange F does not depend on sticking: rays
// between points of the surface are traced once, and every species, sticking and coverage after that is a
// sparse solve that traces nothing. Reciprocity makes the exchange symmetric: a ray joins its two ends both
// ways, so a closed cavity without sticking gets flux 1 exactly, and what noise does to a deep floor is the
// product of two small differences along each ray (exchange_samples.hpp says more).
namespace sidewall::flux {

/// One species to solve for. Spans of one value a wedge.
struct DiffuseSpecies {
    std::string name = "neutral";        ///< for messages
    double source_exponent = 1.0;        ///< one of the exchange's
    double source = 1.0;                 ///< flux on an open horizontal plane; 0 if nothing comes from above
    std::span<const double> sticking{};  ///< in [0, 1], see sticking_by_wedge
    /// Diffuse emission from the surface that is no re-emission (sputtered, desorbed): a flux in the units
    /// of the result, at least 0; empty if there is none. Its own start does not count as an arrival.
    std::span<const double> emission{};
    std::span<const double>
        guess{};  ///< a flux to start the solver from, e.g. of the last coverage iteration
};

struct SolveOptions {
    /// Mean change of an unknown by one more relaxation, relative to it or to 1e-7 of the brightest.
    double tolerance = 1e-5;
    std::uint32_t most_iterations = 2000;
    bool errors = true;          ///< standard errors, for about twice as much time; false leaves them 0
    std::uint32_t halvings = 3;  ///< of the rays that errors come from, 1 to 3: with fewer they scatter more
    bool unbiased = true;        ///< subtracts the bias that halves of the rays show; free with errors
    /// Targets of solve_fluxes_to are for the statistical errors alone, as when two methods on one mesh are compared.
    bool of_rays = false;
    std::function<bool()> stop{};
};

/// A solved flux. Per triangle, wedge and vertex as the tracer's, see TallyFlux.
struct RadiosityFlux : TallyFlux {
    double relative_error = 0.0;  ///< the root of the sum of the squares of the next two; 0 without errors
    /// sum(area * standard error) / sum(area * flux) over vertices, as FluxResult's: of the rays.
    double statistical_error = 0.0;
    /// Error of the linear elements: sum(area * rms error of a triangle) / sum(area * flux), see
    /// residual.hpp.
    double discretisation_error = 0.0;
    double absorbed = 0.0, escaped = 0.0;  ///< of what source and surface emit; their sum is 1
    std::uint32_t iterations = 0;          ///< of the solver, without those for the errors
    double seconds = 0.0;                  ///< wall time
};

/// Solves for \p species on the rays gathered so far. Traces no ray.
///
/// The answer is consistent, not unbiased: its bias falls as 1/rays, and the part that two halves of the rays
/// show is subtracted. Standard errors come from the difference between halves, in `halvings` ways to halve.
/// \throws RecipeError for values out of range or an exponent that was not gathered, GeometryError for arrays
///         that do not fit, Interrupted, NumericsError if the balance has no solution (nothing sticks and
///         nothing escapes) or the solver does not converge, saying why.
RadiosityFlux solve_flux(const Exchange& exchange, const DiffuseSpecies& species,
                         const SolveOptions& options = {});

}  // namespace sidewall::flux
