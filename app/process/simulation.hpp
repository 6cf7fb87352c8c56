#pragma once
#include <filesystem>
#include <string>

#include "app/common/json.hpp"
#include "app/common/timing.hpp"
#include "app/recipe/recipe.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

struct RunOptions {
    std::filesystem::path output;  ///< folder for results
    bool resume = false;           ///< go on from the folder's checkpoint
    bool overwrite = false;        ///< replace whatever run or file stands in the folder's way
    bool quiet = false;            ///< no progress, no lines
    std::string title = "run";     ///< of the progress bar
    std::string resume_command;    ///< what an interrupted run tells the user to go on with, if anything
};

/// What a finished run leaves behind besides its files.
struct RunResult {         // NOLINT(bugprone-exception-escape): moving JSON only asserts
    TriangleMesh surface;  ///< the final surface as extracted
    Timing timing;
    Json summary;  ///< what summary.json holds
};

/// Runs a recipe and writes DIR/{manifest.txt, recipe.toml, surface.pvd, surface_NNNN.vtp, profile_NNNN.csv,
/// timeline.csv, checkpoint.vdb, summary.json}; summary.json comes last, so that a folder that has one is
/// complete: resuming it changes nothing, unless the recipe goes on for longer (process/extension.hpp).
/// \throws Interrupted if the user asked to stop, after the current time step or, while tracing, at once: the
///         checkpoint holds the last whole time step and allows
///         --resume, which ends in the same bits. Other errors as their parts throw them.
RunResult run_recipe(const Recipe& recipe, const RunOptions& options);

}  // namespace sidewall::app
