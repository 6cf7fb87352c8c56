#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
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

// What a run takes from its caller and what it gives back.
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

/// V in place of a model's own, for laws of other languages: Model::speeds for a step of the recipe.
using CallerLaw =
    std::function<std::vector<double>(const Step&, const Model&, std::span<const SurfacePoint>)>;

/// Subfolder of a run's folder for the runs made beside it (accuracy/accuracy.hpp).
inline constexpr const char* kAccuracyFolder = "accuracy";

/// Where a run writes, and how it and its caller speak to each other.
struct RunOptions {
    std::filesystem::path output;  ///< folder for results
    bool resume = false;           ///< go on from the folder's checkpoint
    bool overwrite = false;        ///< replace whatever run or file stands in the folder's way
    bool refines = false;  ///< one of several to an accuracy: records of others, in kAccuracyFolder, stay
    std::uint32_t checkpoint_every =
        0;               ///< time steps; 0: a checkpoint at each saved surface, and where it is stopped
    bool quiet = false;  ///< no progress bar, no lines on what happens to the wafer
    std::string title = "run";   ///< of the progress bar
    std::string resume_command;  ///< with which an interrupted run goes on, for its message; may be empty
    std::function<void(std::string_view)> warn{};  ///< takes warnings, a line each; empty: none is said
    std::function<bool()> stop = interrupted;      ///< asked often, by any thread; true interrupts the run
    std::function<void(const Moment&)> observe{};  ///< called before every time step and once at the end,
                                                   ///< when all files are written; the run waits for it, and
                                                   ///< goes on with another recipe if it throws Revised
    CallerLaw speeds{};                            ///< in place of all models' own, if set
    flux::Shares
        shares{};  ///< processes that make the same run and share its traces; rank 0 writes the files
    std::uint32_t processes_here = 1;  ///< of them, in this machine's memory
};

/// Thrown by a run's observer before a time step: the run goes on from there with another recipe, one that
/// require_revision lets pass. The observer is then called for that time step anew.
struct Revised {
    std::shared_ptr<const Recipe> recipe;
};

/// What a finished run leaves behind besides its files.
struct RunResult {         // NOLINT(bugprone-exception-escape): moving JSON only asserts
    TriangleMesh surface;  ///< the final surface as extracted
    Timing timing;
    Json summary;  ///< what summary.json holds
};

/// The model of a step that takes time, with a caller's law for its speed if there is one.
/// \param law  empty: the model's own.
/// \throws RecipeError if the model's speed turns with the normal, which no other law can stand for.
Model model_with_law(const Recipe& recipe, const CallerLaw& law, const Step& step);

}  // namespace sidewall::app
