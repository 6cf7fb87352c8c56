#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/state.hpp"
#include "app/process/time_step.hpp"
#include "app/recipe/recipe.hpp"
#include "app/results/metrology.hpp"

namespace sidewall::app {

/// What summary.json holds of a run that has ended.
/// \param steps    of the recipe, loops unrolled.
/// \param surface  the final one.
Json summary_of(const Recipe& recipe, const RunState& state, const std::vector<Step>& steps,
                const TracedSurface& surface);

// The texts of a run's tables: timeline.csv and surface.pvd.
/// The line of timeline.csv with the columns' names and units.
std::string timeline_header(const Recipe& recipe, const std::vector<Measure>& measures);

/// A row of timeline.csv up to its measures: the surface before the time step \p next, and what arrives on it.
std::string timeline_row(const RunState& state, const Step& step, const TracedSurface& surface,
                         const TimeStep& next);

/// A row of timeline.csv up to its measures for the surface at the end of a step. What is of a time step is empty.
std::string timeline_end_row(const RunState& state, const Step& step, const TriangleMesh& surface);

/// The places at which the first lines of a timeline end: 0, then one a line, for at most \p most lines.
std::vector<std::size_t> row_ends(const std::string& text, std::size_t most);

/// What surface.pvd holds, which ParaView opens: the files by time, each with the step at whose end the wafer was so.
std::string pvd_text(const std::vector<SavedFile>& files);

}  // namespace sidewall::app
