#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The expected cost of a run. If the wafer takes too long to build even on a coarser grid, only \p memory
/// and \p building are set.
struct Estimate {
    double memory = 0.0;      ///< bytes: estimated_memory, rays of radiosity and the program itself
    double time_steps = 0.0;  ///< of all steps, loops unrolled
    double rays = 0.0;        ///< source rays of all species and time steps
    double flux_error =
        0.0;  ///< relative flux error of the worst species; 0 if nothing is traced, infinite without hits
    double seconds = 0.0;  ///< wall time with the present number of threads
    /// Bounds of seconds. Least: time steps set by the materials bare at first, stop condition met as early
    /// as possible. Most: by the fastest material that the step meets, no stop. Both widened by a factor 2.
    double least_seconds = 0.0, most_seconds = 0.0;
    double narrowest = 0.0;     ///< narrowest opening in the cut of [metrology] at the start; 0: none
    double aspect_ratio = 0.0;  ///< height of the initial surface over narrowest
    double building = 0.0;      ///< seconds to build the wafer, a part of seconds
    bool known = true;          ///< time_steps, rays and seconds are set
    std::vector<std::string>
        short_of;  ///< messages about relative errors that the allowed rays do not reach, each once
    std::vector<std::string>
        methods;  ///< how steps trace their species, each once; empty with Monte Carlo only
};

/// Builds the recipe's wafer, makes the first time step of each step without writing anything, and
/// extrapolates. The number of time steps follows from a step's duration or stop condition and the speed of
/// the fastest material on the wafer; wall time from the measured phases, tracing in proportion to rays.
///
/// Usually within a factor of two. What a step uncovers or closes later is not seen. [flux] reuse, which
/// depends on how fluxes change, is not taken into account.
/// \param effort  seconds to spend on tracing. After three times as long, remaining steps are counted by
///                duration, like those before. A large wafer is measured on a grid up to four times coarser.
/// \param most_building  seconds that building the wafer may take, judged from its cells and layers.
/// \throws what the run would throw at once: RecipeError for a step that never ends or polishes below all
///         that the steps before can etch, GeometryError for a shape without a surface, NumericsError.
Estimate estimate_run(const Recipe& recipe, double effort = 1.0, double most_building = 10.0);

}  // namespace sidewall::app
