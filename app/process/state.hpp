#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/common/timing.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/record/run_history.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// A file of the run's folder that shows the surface at one time, or a part of what lies below it.
struct SavedFile {
    double time = 0.0;
    int part = 0;       ///< counts the files of that time
    std::string file;   ///< its name
    std::string after;  ///< the step at whose end the wafer was so; empty: during a step
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

/// What the step at hand knows of its endpoint.
struct RunEndpoint {
    std::optional<std::vector<int>>
        masks;  ///< none: not noted yet; materials that leave the openings of a step that stops at a material
    std::optional<double> time;  ///< since RunState::epoch, when a stop condition held
    std::string key;             ///< of that condition
    std::optional<double> bare;  ///< share of the floor that was bare then (process/endpoint.hpp)
};

/// Everything a run carries from one time step to the next; a checkpoint holds it all.
struct RunState {
    levelset::MaterialStack stack;
    std::size_t step = 0;  ///< of the recipe, loops unrolled
    /// Process time from which step_start and time count: 0, but set anew by a step too short to be resolved in
    /// the process time before it (begin_step).
    double epoch = 0.0;
    double step_start = 0.0;      ///< since the epoch, when the step at hand began
    double time = 0.0;            ///< since the epoch
    std::vector<double> starts;   ///< process times at which the steps so far began
    std::uint32_t time_step = 0;  ///< over the whole run
    std::size_t saved = 0;        ///< surfaces written
    std::size_t rows = 0;         ///< of the timeline, less its last one if that is end_row
    std::string end_row;          ///< of the step that has just ended: a longer recipe may extend that step
    std::string timeline,
        manifest;  ///< digests, of the timeline up to rows; empty in earlier versions' checkpoints
    std::vector<std::size_t> time_steps;  ///< taken in each step of the recipe
    SurfaceField carried;                 ///< what the last trace left on the surface
    FluxReuse reuse;                      ///< of its fluxes
    RunEndpoint endpoint;                 ///< of the step at hand, or the last that took time
    StepNoise noise;                      ///< of the step at hand
    std::vector<SpeciesMethod> methods;   ///< of the step at hand's species; empty before its first trace
    std::vector<SavedFile> files;         ///< what surface.pvd lists
    std::vector<SavedStack> stacks;       ///< of the surfaces written
    std::vector<InputFile> inputs;        ///< that the recipe names
    History history;                      ///< what summary.json says of all steps
    Timing timing;

    double process_time() const { return epoch + time; }
    /// Time since a process time, such as one of starts.
    double since(double start) const { return time - (start - epoch); }
    /// \p stop is since the epoch.
    bool reached(double stop) const { return time >= stop; }
    /// No time step has been made yet of the step at hand.
    bool begins_step() const { return time == step_start; }
    /// The wafer that the step at hand has now is saved.
    bool is_saved() const {
        return !stacks.empty() && stacks.back().time == process_time() && stacks.back().step == step;
    }
    /// Time since the epoch at which the next of the surfaces saved every so often is due.
    double next_save(double every) const { return static_cast<double>(saved) * every - epoch; }
    /// The time step at hand ends with a choice of all levels' columns.
    bool chooses_columns() const;
    /// Prepares the first time step of a step of the recipe that lasts so long, which has no endpoint yet: a step under a millionth of the
    /// process time before it counts from its own start, where that time would not resolve its time steps.
    void begin_step(double duration);
    /// Ends a time step of \p dt, which the caller cut so that it cannot pass \p stop: the last one lands on
    /// it exactly.
    /// \throws NumericsError if the time is too long for \p dt to advance it.
    void advance(double dt, double stop);
    /// Goes to a step of the recipe.
    void enter(std::size_t next);
};

/// The files that the recipe names, as they are now.
/// \throws FileError, IoError if one cannot be read.
std::vector<InputFile> input_files(const Recipe& recipe);

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

/// The state in DIR/checkpoint.vdb, from which the recipe can go on (process/revision.hpp).
/// \throws FileError if there is none, it is damaged, or naming how the recipe that made it differs.
RunState resume_state(const std::filesystem::path& folder, const Recipe& recipe);

/// Writes DIR/checkpoint.vdb.
/// \throws IoError; the old one stays whole.
void save_state(const std::filesystem::path& folder, const Recipe& recipe, const RunState& state);

}  // namespace sidewall::app
