#pragma once
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "app/models/model.hpp"
#include "app/process/arriving/traced_surface.hpp"
#include "app/process/record/run_history.hpp"
#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

// When a step ends: how much of a material is bare under the openings, and what goes on after an endpoint.
namespace sidewall::app {

/// How much is bare of the floor under the openings.
///
/// The floor is what is seen from straight above and is the material itself, or has it below, is no mask, and rises by
/// less than 45 degrees. Areas are those of the top view. Walls above the material do not count, so that a tapered hole
/// can be open, nor does what an overhang hides. In the cell of a wall's foot, whose corner the surface cuts off, a cover thinner
/// than that cut does not count where there is other floor.
struct BareFloor {
    double share = 0.0;       ///< of the floor, on which the material is bare; 0 without a floor
    double left = kInfinity;  ///< thickness that covers it where the share that is asked
                              ///< for would be reached; infinite without a floor
};

/// Measures the floor. A film of less than levelset::kExposed counts as gone.
/// \param masks  materials that are no floor.
/// \param asked  share for \p left.
/// \note O(n) in triangles; O(n log n) if the material is not the substrate's.
BareFloor bare_floor(const levelset::MaterialStack& stack, const TriangleMesh& surface, int material,
                     const std::vector<int>& masks, double asked);

/// The share of the floor that is bare of the material at which the step stops; nothing if it stops at none.
std::optional<double> bare_share(const Recipe& recipe, const Step& step, const RunState& state,
                                 const TriangleMesh& surface);

/// Notes the masks of a step that begins, if it stops at a material: what is seen from above, lies higher in the stack than the
/// material that goes fastest there, and goes at less than half its speed.
/// \param surface  with what arrives on it.
void note_masks(const Recipe& recipe, const Step& step, const Model& model, const TracedSurface& surface,
                RunState& state);

/// Notes that a stop condition of the step at hand holds now.
void note_endpoint(const Recipe& recipe, const Step& step, const char* key, const TriangleMesh& surface,
                   RunState& state);

/// When the step at hand ends, since RunState::epoch: after its duration, or when the over-etch after its endpoint is done.
double step_end(const Step& step, const RunState& state);

/// How the step at hand has ended, for its line in the history.
/// \param surface  as it is then.
StepEnd end_of(const Recipe& recipe, const Step& step, const RunState& state, const TriangleMesh& surface);

/// A line on a step that its endpoint has ended, or that did not come to it; empty for a step without a stop condition.
std::string end_line(const Recipe& recipe, const Step& step, const RunState& state, const StepEnd& end);

}  // namespace sidewall::app
