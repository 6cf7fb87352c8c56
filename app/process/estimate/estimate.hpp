#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// What a run of a recipe will take, from the first time step of each of its steps. Of one whose wafer takes too
/// long to build even on a coarser grid, only \p memory and \p building are known.
struct Estimate {
    double memory = 0.0;      ///< bytes: estimated_memory, rays of radiosity and the program itself
    double time_steps = 0.0;  ///< of all steps, loops unrolled
    double rays = 0.0;        ///< source rays of all species and time steps
    double flux_error =
        0.0;  ///< relative, of the worst species; 0 if nothing is traced, infinite if nothing is hit
    double seconds = 0.0;  ///< wall time with the threads at hand
    /// What bounds it: the materials bare at first, or the fastest that the step meets, set its time steps; its stop
    /// condition is met as early as can be, or never; a surface of other size and load of the machine leave a factor of 1.6.
    double least_seconds = 0.0, most_seconds = 0.0;
    double narrowest = 0.0;     ///< opening in the cut of [metrology] at the start; 0: none
    double aspect_ratio = 0.0;  ///< height of that surface over it
    double building = 0.0;      ///< of these those that the wafer takes
    bool known = true;          ///< time steps, rays and seconds are
    std::vector<std::string>
        short_of;  ///< relative errors that the rays allowed do not reach, in words, each once
    std::vector<std::string>
        methods;  ///< how steps trace their species, each once; empty with Monte Carlo alone
};

/// Builds the recipe's wafer and makes the first time step of each of its steps, without writing anything;
/// then extrapolates: a step's time steps from its duration or stop condition and the speed of the fastest
/// material that lies on the wafer, wall time from its phases, tracing in proportion to the rays.
///
/// Usually within a factor of two; what a step uncovers or closes later is not seen. With [flux] reuse, which
/// depends on how fluxes change, rays and seconds are those without it.
/// \param effort  seconds to spend tracing; three times as long and steps that are left count by their duration,
///                like those before. A large wafer is measured on a grid up to four times coarser.
/// \param most_building  seconds that building the wafer may take, reckoned from its cells and layers
/// \throws what the run would throw at once: RecipeError for a step that never ends or one that polishes below
///         all that the steps before can etch, GeometryError for a shape without a surface, NumericsError.
Estimate estimate_run(const Recipe& recipe, double effort = 1.0, double most_building = 10.0);

}  // namespace sidewall::app
