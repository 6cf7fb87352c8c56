#pragma once
#include "app/process/run_options.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Runs a recipe and writes DIR/{manifest.txt, recipe.toml, surface.pvd, surface_NNNN.vtp, profile_NNNN.csv,
/// timeline.csv, checkpoint.vdb, summary.json}; summary.json comes last, so that a folder that has one is
/// complete: resuming it changes nothing, unless the recipe goes on for longer (process/revision.hpp).
/// \throws Interrupted if the user asked to stop, after the current time step or, while tracing, at once: the
///         checkpoint holds the last whole time step and allows
///         --resume, which ends in the same bits. Other errors as their parts throw them.
RunResult run_recipe(const Recipe& recipe, const RunOptions& options);

}  // namespace sidewall::app
