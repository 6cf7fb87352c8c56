#pragma once
#include "app/process/run_options.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Runs a recipe and writes DIR/{manifest.txt, recipe.toml, surface.pvd, surface_NNNN.vtp,
/// interface_NNNN_K.vtp, traced_NNNN.vtp, profile_NNNN.csv, timeline.csv, checkpoint.vdb, summary.json}.
/// summary.json comes last: a folder that has one is complete, and resuming it changes nothing unless the
/// recipe has become longer (process/revision.hpp).
/// \throws Interrupted if the user asked to stop: while tracing at once, else after the current time step.
///         The checkpoint holds the last whole time step; --resume from it ends in the same bits as an
///         uninterrupted run. Other errors as the parts throw them.
RunResult run_recipe(const Recipe& recipe, const RunOptions& options);

}  // namespace sidewall::app
