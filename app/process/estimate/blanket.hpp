#pragma once
#include <string>
#include <vector>

#include "app/recipe/step_materials.hpp"

namespace sidewall::app {

/// The speed of an open, flat wafer of one material during a step.
struct BlanketRate {
    int material = 0;     ///< its id
    double rate = 0.0;    ///< length per time in the recipe's units; positive grows, negative etches
    std::string unknown;  ///< why the model has no rate for it; else empty
};

/// The blanket rates of all materials that a step meets, including the film it deposits.
///
/// Nothing is traced: the flux of every species is 1, each yield is its mean over the source's angles and
/// energies, nothing that leaves a flat wafer returns, and gas collisions change nothing. Coverages are in
/// steady state; transient ones are those after the step's duration, pulsed ones those after one pulse.
std::vector<BlanketRate> blanket_rates(const StepMaterials& here);

/// The largest blanket |V| of all materials that the step meets.
double fastest_blanket(const Recipe& recipe, const Step& step);

/// Notes on stop conditions that a step cannot meet in its duration (depths and films beyond what blanket
/// rates reach; bare floors where no cover is etched) and on fills below the lowest point reached. Skips
/// steps whose surfaces may move faster than an open wafer's.
std::vector<std::string> unmet_stops(const Recipe& recipe);

/// All notes that a user should read before a run: notes_on and unmet_stops.
std::vector<std::string> notes_before_run(const Recipe& recipe);

/// The blanket rates of every step in nm per time unit, their meaning and selectivities, as TOML comments.
std::string blanket_table(const Recipe& recipe);

}  // namespace sidewall::app
