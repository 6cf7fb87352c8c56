#pragma once
#include <string>
#include <vector>

#include "app/recipe/step_materials.hpp"

namespace sidewall::app {

/// The speed of an open, flat wafer of one material in a step.
struct BlanketRate {
    int material = 0;     ///< id
    double rate = 0.0;    ///< length per time in the recipe's units; positive grows, negative etches
    std::string unknown;  ///< why the model has no rate there; empty if it has
};

/// The blanket rates of all materials that a step meets, its own film among them.
///
/// Nothing is traced: of every species 1 arrives, each of its yields has its mean over the source's angles and energies,
/// and nothing that leaves a flat wafer comes back, nor do collisions in a gas change what arrives there. Coverages are in steady state; those with rates of their own are as
/// the step's duration leaves them, those of pulses as one pulse does.
std::vector<BlanketRate> blanket_rates(const StepMaterials& here);

/// The largest |V| of a flat wafer of any material that the step meets.
double fastest_blanket(const Recipe& recipe, const Step& step);

/// Notes on the stop conditions that no step can meet in its duration: depths and films beyond what blanket rates reach, and
/// bare floors where nothing that could cover them is etched; and fills below all that the steps before reach. Silent about steps whose surfaces may move faster than an open wafer's.
std::vector<std::string> unmet_stops(const Recipe& recipe);

/// All that a user should know of a recipe before it runs: notes_on and unmet_stops.
std::vector<std::string> notes_before_run(const Recipe& recipe);

/// The blanket rates of every step in nm per unit of time, what they mean and the selectivities, as comments of TOML.
std::string blanket_table(const Recipe& recipe);

}  // namespace sidewall::app
