#pragma once
#include <optional>

#include "app/common/files.hpp"
#include "app/common/json_fwd.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/record/manifest.hpp"
#include "app/process/run_options.hpp"
#include "app/process/state.hpp"
#include "app/process/time_step.hpp"
#include "app/results/metrology.hpp"

namespace sidewall::app {

/// Writes a run's folder. Every file is whole or absent, and listed in manifest.txt before it is made. Where several
/// processes make the run, rank 0 writes; the others keep the same state, and go on when rank 0 knows what the folder holds.
class RunFolder {
  public:
    /// Makes the folder, keeps other processes from writing there, and finds what it holds; changes nothing
    /// else. Keeps references to \p options and \p recipe.
    /// \throws IoError if another process writes there; RecipeError if a new run would replace a file that no
    ///         run has written, an unfinished run or another recipe's result, and options.overwrite does not
    ///         ask for it.
    RunFolder(const RunOptions& options, const Recipe& recipe);

    /// The run goes on from the folder's checkpoint; else it begins at time 0.
    bool goes_on() const { return goes_on_; }
    /// The folder holds a run that has ended.
    bool finished() const { return finished_; }
    /// Checks what a run wrote before its checkpoint.
    /// \throws FileError if its timeline or its manifest is another one.
    void require_unchanged(const RunState& state) const;
    /// Removes what an earlier run wrote; of a run that goes on, what it wrote since the checkpoint.
    /// \throws FileError as require_unchanged(), of a run that goes on.
    void begin(RunState& state);

    /// The recipe has changed: it and a checkpoint of it are written.
    void revise(RunState& state);

    /// Whether a surface is to be saved at this time.
    bool due(const RunState& state) const;
    /// Writes surface, traced mesh, material interfaces and profiles, and lists them in surface.pvd.
    /// \param after  the step at whose end the wafer is so; empty within a step.
    void save(RunState& state, const Model& model, const TracedSurface& surface, const std::string& after);
    /// Adds a row to timeline.csv: the surface before the time step \p next.
    void record(RunState& state, const Step& step, const TracedSurface& surface, const TimeStep& next);
    /// Adds a row to timeline.csv: the surface and its measures at the end of a step, with no time step.
    void record_end(RunState& state, const Step& step, const TriangleMesh& surface,
                    const std::vector<Measure>& measures);
    void checkpoint(RunState& state) const;
    /// Writes summary.json and returns it.
    Json finish(const RunState& state, const std::vector<Step>& steps, const TracedSurface& surface);

  private:
    enum class Held { nothing, run, result, other_run, other_result };  // of this recipe or another one
    void claim();
    Held holds() const;
    void take_over();
    void refuse_foreign_files(bool has_manifest) const;
    void refuse_other_runs() const;
    void begin_anew();
    void go_on(RunState& state);
    [[noreturn]] void refuse_changed(const char* name) const;
    std::string digest_of_names(std::size_t saved) const;
    void require_there() const;
    fs::path timeline() const { return options_.output / "timeline.csv"; }
    void cut_timeline(RunState& state) const;
    void list(std::vector<std::string> names);
    void append_row(const RunState& state, const std::string& row,
                    const std::vector<Measure>& measures) const;
    void write_meshes(RunState& state, const Model& model, const TracedSurface& surface,
                      const std::string& after);
    void write_profiles(const TriangleMesh& surface, std::size_t number) const;
    void write_pvd(const RunState& state) const;

    const RunOptions& options_;
    const Recipe& recipe_;
    std::string effective_;           // recipe
    std::optional<FolderLock> lock_;  // held by the first rank only
    FileNames names_;                 // in the manifest
    bool writes_;
    bool goes_on_ = false, finished_ = false;
};

/// Whether a folder's recipe.toml is \p effective, byte by byte.
bool holds_recipe(const fs::path& folder, const std::string& effective);

}  // namespace sidewall::app
