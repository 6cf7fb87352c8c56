#pragma once
#include <vector>

#include "app/common/json_fwd.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// What summary.json holds of a run that has ended.
/// \param steps    of the recipe, loops unrolled.
/// \param surface  the final one.
Json summary_of(const Recipe& recipe, const RunState& state, const std::vector<Step>& steps,
                const TracedSurface& surface);

}  // namespace sidewall::app
