#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/common/timing.hpp"
#include "app/process/arriving/flux_reuse.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/record/run_history.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// A file of the run's folder that shows the surface at one time, or a part of what lies below it.
struct SavedFile {
    double time = 0.0;
    int part = 0;  ///< counts the files of that time
    std::string name;
};

/// The wafer as a saved surface and its interfaces show it.
struct SavedStack {
    double time = 0.0;
    std::size_t step = 0;        ///< that was at hand
    std::vector<int> materials;  ///< of the layers, bottom up
};

/// A mesh, layout or profile that the recipe names.
struct InputFile {
    std::string path;    ///< absolute
    std::string digest;  ///< of its bytes
};

/// Everything a run carries from one time step to the next; a checkpoint holds it all.
struct RunState {
    levelset::MaterialStack stack;
    std::size_t step = 0;                 ///< of the recipe, loops unrolled
    double step_start = 0.0;              ///< process time at which it began
    std::vector<double> starts;           ///< the same of every step so far
    double time = 0.0;                    ///< process time
    std::uint32_t time_step = 0;          ///< over the whole run
    std::size_t saved = 0;                ///< surfaces written
    std::size_t rows = 0;                 ///< of the timeline
    std::vector<std::size_t> time_steps;  ///< taken in each step of the recipe
    SurfaceField carried;                 ///< what the last trace left on the surface
    FluxReuse reuse;                      ///< of its fluxes
    std::vector<SpeciesMethod> methods;   ///< of the step at hand's species; empty before its first trace
    std::vector<SavedFile> files;         ///< what surface.pvd lists
    std::vector<SavedStack> stacks;       ///< of the surfaces written
    std::vector<InputFile> inputs;        ///< that the recipe names
    History history;                      ///< what summary.json will tell of it all
    Timing timing;

    bool reached(double stop) const { return time >= stop; }
    /// No time step has been made yet of the step at hand.
    bool begins_step() const { return time == step_start; }
    /// The surface of this time is saved.
    bool is_saved() const { return !files.empty() && files.back().time == time; }
    /// The time step at hand ends with a choice of all levels' columns.
    bool chooses_columns() const;
    /// Ends a time step of \p dt, which the caller cut so that it cannot pass \p stop: the last one lands on
    /// it exactly.
    void advance(double dt, double stop);
    /// Begins a step of the recipe.
    void enter(std::size_t next);
};

/// The stack of the recipe's layers, or of the run that it starts from, at time 0.
RunState initial_state(const Recipe& recipe);

/// What DIR/checkpoint.vdb holds.
struct Checkpoint {
    RunState state;
    std::string recipe;                  ///< that made it
    std::vector<std::string> materials;  ///< by id
    std::string length_unit;
};

/// Reads DIR/checkpoint.vdb of a run in the recipe's domain.
/// \throws FileError if there is none, or naming how the domains differ; the message ends with \p advice.
Checkpoint read_checkpoint(const std::filesystem::path& folder, const Recipe& recipe,
                           const std::string& advice);

/// The state in DIR/checkpoint.vdb, from which the recipe can go on (process/record/extended_run.hpp).
/// \throws FileError if there is none, it is damaged, or naming how the recipe that made it differs.
RunState resume_state(const std::filesystem::path& folder, const Recipe& recipe);

/// Writes DIR/checkpoint.vdb.
/// \throws IoError; the old one stays whole.
void save_state(const std::filesystem::path& folder, const Recipe& recipe, const RunState& state);

}  // namespace sidewall::app
