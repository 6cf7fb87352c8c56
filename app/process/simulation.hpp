#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/timing.hpp"
#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "flux/shares.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// The wafer before a time step, or at the run's end. What it refers to lasts until the observer returns.
struct Moment {
    const Step& step;  ///< of the recipe, loops unrolled; the last one at the end
    const Model& model;
    const RunState& state;
    std::shared_ptr<const TracedSurface> surface;  ///< and what arrives on it; may be kept for longer
    double dt = 0.0;                               ///< of the time step about to be made; 0 at the end
    const Json* summary = nullptr;                 ///< at the end, what summary.json holds
};

/// V in place of a model's own, for laws of other languages: Model::speeds of a step of the recipe.
using SpeedLaw = std::function<std::vector<double>(const Step&, const Model&, std::span<const SurfacePoint>)>;

/// In a run's folder, of the runs made beside it (accuracy/accuracy.hpp).
inline constexpr const char* kAccuracyFolder = "accuracy";

struct RunOptions {
    std::filesystem::path output;  ///< folder for results
    bool resume = false;           ///< go on from the folder's checkpoint
    bool overwrite = false;        ///< replace whatever run or file stands in the folder's way
    bool refines = false;  ///< one of several to an accuracy: records of others, in kAccuracyFolder, stay
    bool quiet = false;    ///< no progress, no lines
    std::string title = "run";   ///< of the progress bar
    std::string resume_command;  ///< what an interrupted run tells the user to go on with, if anything
    std::function<bool()> stop = interrupted;      ///< asked often, by any thread; true interrupts the run
    std::function<void(const Moment&)> observe{};  ///< called before every time step and once at the end,
                                                   ///< when all files are written; the run waits for it, and
                                                   ///< goes on with another recipe if it throws Revised
    SpeedLaw speeds{};                             ///< in place of all models' own, if set
    flux::Shares
        shares{};  ///< processes that make the same run and share its traces; rank 0 writes the files
    std::uint32_t processes_here = 1;  ///< of them, in this machine's memory
};

/// What a finished run leaves behind besides its files.
struct RunResult {         // NOLINT(bugprone-exception-escape): moving JSON only asserts
    TriangleMesh surface;  ///< the final surface as extracted
    Timing timing;
    Json summary;  ///< what summary.json holds
};

/// Runs a recipe and writes DIR/{manifest.txt, recipe.toml, surface.pvd, surface_NNNN.vtp, profile_NNNN.csv,
/// timeline.csv, checkpoint.vdb, summary.json}; summary.json comes last, so that a folder that has one is
/// complete: resuming it changes nothing, unless the recipe goes on for longer (process/record/extended_run.hpp).
/// \throws Interrupted if the user asked to stop, after the current time step or, while tracing, at once: the
///         checkpoint holds the last whole time step and allows
///         --resume, which ends in the same bits. Other errors as their parts throw them.
RunResult run_recipe(const Recipe& recipe, const RunOptions& options);

}  // namespace sidewall::app
