#pragma once
#include "app/common/json_fwd.hpp"
#include "app/process/simulation.hpp"
#include "app/process/state.hpp"
#include "app/process/time_step.hpp"
#include "app/process/traced_surface.hpp"

namespace sidewall::app {

/// Writes a run's folder. Every file is whole or absent.
class RunFolder {
  public:
    /// Makes the folder. A new run clears what an earlier one left in it; a resumed one cuts the timeline
    /// back to the checkpoint. Keeps references to \p options and \p recipe.
    /// \throws IoError.
    RunFolder(const RunOptions& options, const Recipe& recipe, const RunState& state);

    /// Whether a surface is to be saved at this time.
    bool due(const RunState& state) const;
    /// Writes surface, traced mesh, material interfaces and profiles, lists them in surface.pvd, and writes a
    /// checkpoint.
    void save(RunState& state, const Model& model, const TracedSurface& surface);
    /// Adds a row to timeline.csv: the surface before the time step \p next.
    void record(RunState& state, const Step& step, const TracedSurface& surface, const TimeStep& next);
    void checkpoint(const RunState& state) const;
    /// Writes summary.json and returns it.
    Json finish(const RunState& state, const std::vector<Step>& steps, const TracedSurface& surface) const;

  private:
    void write_meshes(RunState& state, const Model& model, const TracedSurface& surface) const;
    void write_profiles(const TriangleMesh& surface, std::size_t number) const;
    void write_pvd(const RunState& state) const;

    const RunOptions& options_;
    const Recipe& recipe_;
};

}  // namespace sidewall::app
