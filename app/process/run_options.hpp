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

/// What an observer is given before each time step and at the run's end. References last until it returns.
struct Moment {
    const Step& step;  ///< of the recipe, loops unrolled; at the end the last one
    const Model& model;
    const RunState& state;
    std::shared_ptr<const TracedSurface> surface;  ///< with its fluxes; the observer may keep it
    double dt = 0.0;                               ///< of the next time step; 0 at the end
    const Json* summary = nullptr;                 ///< contents of summary.json; null before the end
};

/// A speed law from the caller, e.g. in another language: replaces Model::speeds in every step of the recipe.
using CallerLaw =
    std::function<std::vector<double>(const Step&, const Model&, std::span<const SurfacePoint>)>;

/// Subfolder of a run's folder for the runs made beside it to an accuracy (accuracy/accuracy.hpp).
inline constexpr const char* kAccuracyFolder = "accuracy";

/// Where a run writes, and how it communicates with its caller.
struct RunOptions {
    std::filesystem::path output;  ///< folder for results
    bool resume = false;           ///< continue from the folder's checkpoint
    bool overwrite = false;        ///< replace any run or file that the new run would meet in the folder
    bool refines = false;  ///< one of several runs to an accuracy: keeps the others in kAccuracyFolder
    std::uint32_t checkpoint_every =
        0;               ///< time steps between extra checkpoints; 0: only at saved surfaces and when stopped
    bool quiet = false;  ///< no progress bar and no lines about events
    std::string title = "run";   ///< of the progress bar
    std::string resume_command;  ///< that resumes an interrupted run, for its message; may be empty
    std::function<void(std::string_view)> warn{};  ///< takes warnings, a line each; empty: they are dropped
    std::function<bool()> stop = interrupted;      ///< polled often, by any thread; true interrupts the run
    std::function<void(const Moment&)>
        observe{};  ///< called before every time step, and at the end when all files are written; the run
                    ///< waits for it, and continues with another recipe if it throws Revised
    CallerLaw speeds{};  ///< if set, replaces the speeds of all models
    flux::Shares
        shares{};  ///< processes that make the same run and share its traces; rank 0 writes the files
    std::uint32_t processes_here = 1;  ///< number of them that share this machine's memory
};

/// Thrown by a run's observer before a time step to continue the run with another recipe, which
/// require_revision must accept. The observer is then called for that time step again.
struct Revised {
    std::shared_ptr<const Recipe> recipe;
};

/// What a finished run returns besides its files.
struct RunResult {         // NOLINT(bugprone-exception-escape): moving JSON only asserts
    TriangleMesh surface;  ///< the final surface as extracted
    Timing timing;
    Json summary;  ///< contents of summary.json
};

/// The model of a step that takes time, with the caller's speed law in place of its own if there is one.
/// \param law  empty: the model keeps its own.
/// \throws RecipeError if the model has a speed V(n), which no such law can replace.
Model model_with_law(const Recipe& recipe, const CallerLaw& law, const Step& step);

}  // namespace sidewall::app
