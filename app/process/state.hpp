#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/common/timing.hpp"
#include "app/process/arriving/surface_field.hpp"
#include "app/process/record/run_history.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// A file in the run's folder that shows the surface at one time, or an interface below it.
struct SavedFile {
    double time = 0.0;
    int part = 0;       ///< number among the files of that time
    std::string file;   ///< its name
    std::string after;  ///< name of the step that ended then; empty: during a step
};

/// The wafer at one time, saved as a surface and its interfaces.
struct SavedStack {
    double time = 0.0;
    std::size_t step = 0;        ///< the current step then
    std::vector<int> materials;  ///< of the layers, from the bottom up
};

/// A file that the recipe reads, or the folder of the run that it starts from.
struct InputFile {
    std::string path;    ///< absolute
    std::string digest;  ///< of the file's bytes, or of that run's checkpoint
};

/// What is known of the current step's endpoint.
struct RunEndpoint {
    std::optional<std::vector<int>>
        masks;  ///< mask materials of a step that stops at a material (note_masks); none: not yet noted
    std::optional<double> time;  ///< when a stop condition held, since RunState::epoch
    std::string key;             ///< the recipe key of that condition
    std::optional<double> bare;  ///< bare share of the floor at that time (process/endpoint.hpp)
};

/// A surface is due at a step's end if their times differ by less than this share of [output] every: sums of
/// durations are rounded.
inline constexpr double kSameTime = 1e-9;

/// Everything that a run carries from one time step to the next; a checkpoint holds all of it.
struct RunState {
    levelset::MaterialStack stack;
    std::size_t step = 0;  ///< index into the recipe's steps, loops unrolled
    /// Process time from which step_start and time count. It is 0 until begin_step meets a step too short to
    /// be resolved in the process time so far, and moves it there.
    double epoch = 0.0;
    double step_start = 0.0;      ///< when the current step began, since the epoch
    double time = 0.0;            ///< since the epoch
    std::vector<double> starts;   ///< process times at which the steps so far began
    std::uint32_t time_step = 0;  ///< counted over the whole run
    std::size_t saved = 0;        ///< number of surfaces written
    std::size_t rows = 0;         ///< rows of the timeline, without end_row
    std::string end_row;  ///< timeline row at the end of the last step; a longer recipe may replace it
    std::string timeline,
        manifest;  ///< digests; the timeline's is of its header and first `rows` rows; empty in old versions
    std::vector<std::size_t> time_steps;  ///< by step: time steps made
    SurfaceField carried;                 ///< values that the last trace left on the surface
    FluxReuse reuse;                      ///< how long the fluxes in carried serve
    RunEndpoint endpoint;                 ///< of the current step, or the last one that took time
    StepNoise noise;                      ///< of the current step
    std::vector<SpeciesMethod> methods;   ///< by species of the current step; empty before its first trace
    std::vector<SavedFile> files;         ///< listed in surface.pvd
    std::vector<SavedStack> stacks;       ///< one for each surface written
    std::vector<InputFile> inputs;        ///< files that the recipe reads, as the run read them
    History history;                      ///< what summary.json reports of all steps
    Timing timing;

    double process_time() const { return epoch + time; }
    /// Time since a process time, such as one of starts.
    double since(double start) const { return time - (start - epoch); }
    /// Whether the time \p stop (since the epoch) has come.
    bool reached(double stop) const { return time >= stop; }
    /// Whether the current step has made no time step yet.
    bool begins_step() const { return time == step_start; }
    /// Whether the wafer at this time of this step has been saved.
    bool is_saved() const {
        return !stacks.empty() && stacks.back().time == process_time() && stacks.back().step == step;
    }
    /// When the next surface is due, since the epoch, if one is saved every \p every of process time.
    double next_save(double every) const { return static_cast<double>(saved) * every - epoch; }
    /// Whether the columns of the grid levels are to be chosen anew at the end of this time step.
    bool chooses_columns() const;
    /// Prepares the first time step of a step of the recipe: clears its endpoint and noise. Moves the epoch
    /// here if \p duration is under 1e-6 of the process time, which would not resolve its time steps.
    void begin_step(double duration);
    /// Ends a time step of \p dt. The caller has cut \p dt so that it does not pass \p stop; the last time
    /// step lands on \p stop exactly.
    /// \throws NumericsError if \p dt is lost in the rounding of the time.
    void advance(double dt, double stop);
    /// Makes step \p next of the recipe the current one.
    void enter(std::size_t next);
};

/// The paths of all that the recipe reads: meshes, layouts and profiles of layers and patterns, tables and
/// sources of models, and the folder of the run that it starts from.
std::set<std::string> input_paths(const Recipe& recipe);

/// Digests of the present contents.
/// \throws FileError if one cannot be read.
std::vector<InputFile> input_files(const std::set<std::string>& paths);

/// Contents of DIR/checkpoint.vdb.
struct Checkpoint {
    RunState state;
    std::string recipe;                  ///< the effective recipe of the run
    std::vector<std::string> materials;  ///< names by id
    std::string length_unit;
};

/// Reads DIR/checkpoint.vdb of a run with the recipe's domain.
/// \throws FileError if there is none, it is damaged, or naming how the domains differ; ends with \p advice.
Checkpoint read_checkpoint(const std::filesystem::path& folder, const Recipe& recipe,
                           const std::string& advice);

/// The state in DIR/checkpoint.vdb, from which the recipe can be continued (process/revision.hpp).
/// \throws FileError if there is none, it is damaged, or its recipe differs (the message says how).
RunState resume_state(const std::filesystem::path& folder, const Recipe& recipe);

/// Writes DIR/checkpoint.vdb.
/// \throws IoError; the old file then stays whole.
void save_state(const std::filesystem::path& folder, const Recipe& recipe, const RunState& state);

}  // namespace sidewall::app
