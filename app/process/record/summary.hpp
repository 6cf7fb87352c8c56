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

/// Contents of summary.json for a finished run.
/// \param steps    of the recipe, loops unrolled.
/// \param surface  at the end.
Json summary_of(const Recipe& recipe, const RunState& state, const std::vector<Step>& steps,
                const TracedSurface& surface);

// The texts of a run's tables: timeline.csv and surface.pvd.
/// The header of timeline.csv: names and units of the columns.
std::string timeline_header(const Recipe& recipe, const std::vector<Measure>& measures);

/// A row of timeline.csv, without its measures, for the surface before the time step \p next.
std::string timeline_row(const RunState& state, const Step& step, const TracedSurface& surface,
                         const TimeStep& next);

/// A row of timeline.csv, without its measures, at the end of a step. Columns about a time step stay empty.
std::string timeline_end_row(const RunState& state, const Step& step, const TriangleMesh& surface);

/// Offsets in \p text at which a timeline's first lines end: 0, then one a line for at most \p most lines.
std::vector<std::size_t> row_ends(const std::string& text, std::size_t most);

/// Contents of surface.pvd for ParaView: the files by time, each with the name of the step that ended then.
std::string pvd_text(const std::vector<SavedFile>& files);

}  // namespace sidewall::app
