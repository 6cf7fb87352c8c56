#pragma once
#include "app/run_state.hpp"
#include "app/simulation.hpp"
#include "app/surface_flux.hpp"

namespace sidewall::app {

/// Writes a run's folder. Every file is whole or absent.
class RunWriter {
  public:
    /// Makes the folder. A new run clears what an earlier one left in it; a resumed one cuts the timeline
    /// back to the checkpoint.
    /// \throws IoError.
    RunWriter(const RunOptions& options, const Recipe& recipe, const RunState& state);

    /// Whether a surface is to be saved at this time.
    bool due(const RunState& state) const;
    /// Writes surface, traced mesh, material interfaces and profiles, lists them in surface.pvd, and writes a
    /// checkpoint.
    void save(RunState& state, const Model& model, const SurfaceFlux& surface);
    /// Adds a row to timeline.csv: the surface before a time step of \p dt at largest speed \p speed.
    void record(RunState& state, const Step& step, const SurfaceFlux& surface, double dt, double speed);
    void checkpoint(const RunState& state) const;
    /// Writes summary.json and returns it.
    Json finish(const RunState& state, const std::vector<Step>& steps, const SurfaceFlux& surface);

  private:
    void write_pvd(const RunState& state) const;

    const RunOptions& options_;
    const Recipe& recipe_;
};

}  // namespace sidewall::app
