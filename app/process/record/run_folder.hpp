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

/// Writes a run's folder. Each file is complete or absent, and listed in manifest.txt before it is made. If
/// several processes make the run, rank 0 writes; the others keep the same state and wait for rank 0's view
/// of the folder.
class RunFolder {
  public:
    /// Makes the folder, locks it against other processes, and finds what it holds; changes nothing else.
    /// Keeps references to \p options and \p recipe.
    /// \throws IoError if another process writes there; RecipeError if a new run would replace a file that no
    ///         run has written, an unfinished run or another recipe's result without options.overwrite.
    RunFolder(const RunOptions& options, const Recipe& recipe);

    /// Whether the run continues from the folder's checkpoint; else it begins at time 0.
    bool goes_on() const { return goes_on_; }
    /// Whether the folder holds a finished run.
    bool finished() const { return finished_; }
    /// Checks that the files written before the checkpoint are unchanged.
    /// \throws FileError if the timeline or the manifest has changed.
    void require_unchanged(const RunState& state) const;
    /// Removes the files of an earlier run; of a run that continues, those written since its checkpoint.
    /// \throws FileError as require_unchanged(), if the run continues.
    void begin(RunState& state);

    /// Writes a changed recipe and a checkpoint with it.
    void revise(RunState& state);

    /// Whether a surface is to be saved at this time.
    bool due(const RunState& state) const;
    /// Writes surface, traced mesh, material interfaces and profiles, and lists them in surface.pvd.
    /// \param after  name of the step that ends at this time; empty within a step.
    void save(RunState& state, const Model& model, const TracedSurface& surface, const std::string& after);
    /// Adds a row to timeline.csv: the surface before time step \p next. Adds its noise to the state.
    void record(RunState& state, const Step& step, const TracedSurface& surface, const TimeStep& next);
    /// Adds a row to timeline.csv for the surface and its measures at the end of a step.
    void record_end(RunState& state, const Step& step, const TriangleMesh& surface,
                    const std::vector<Measure>& measures);
    void checkpoint(RunState& state) const;
    /// Writes summary.json and returns it.
    Json finish(const RunState& state, const std::vector<Step>& steps, const TracedSurface& surface);

  private:
    enum class Held { nothing, run, result, other_run, other_result };  // other_*: of another recipe
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
    std::string effective_;           // the effective recipe
    std::optional<FolderLock> lock_;  // held by rank 0 only
    FileNames names_;                 // in the manifest
    bool writes_;
    bool goes_on_ = false, finished_ = false;
};

/// Whether a folder's recipe.toml is \p effective, byte by byte.
bool holds_recipe(const fs::path& folder, const std::string& effective);

}  // namespace sidewall::app
