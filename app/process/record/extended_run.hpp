#pragma once
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Lets a run that another recipe began go on with this one, where the two agree: in all but their steps, and in
/// the steps that are done. The step at hand, or the last one of a finished run, may last longer or have a
/// later stop_depth or stop_thickness; names of steps may differ.
/// \throws FileError naming the differences that forbid it.
void extend(RunState& state, const Recipe& recipe, const Recipe& began_with);

}  // namespace sidewall::app
