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

// When a step ends: how much of a material is bare under the openings, and the over-etch after an endpoint.
namespace sidewall::app {

/// How much of a material is bare on the floor under the openings.
///
/// The floor is all that is visible from straight above and is either the bare material or a cover: a surface
/// that rises by less than 45 degrees, is neither a mask nor a film on one, and has the material below it.
/// Areas are those of the top view. Walls above the material do not count, so that a tapered hole can be
/// open; nor does what an overhang hides. Two kinds of covers count only where there is no other floor: a film
/// nearer to a mask than to the material, as on the mask's walls; and a cover in the cell at the foot of a
/// wall, thinner than the corner that the extracted surface cuts off there.
struct BareFloor {
    double share = 0.0;       ///< bare part of the floor's area, 0 to 1; 0 without a floor
    double left = kInfinity;  ///< cover to remove until the share exceeds the one asked for; or infinite
};

/// Measures the floor of \p material. A film thinner than levelset::kExposed cells counts as removed.
/// \param masks  materials that do not count as floor.
/// \param asked  share that \p left is for.
/// \note O(n) in triangles; O(n log n) if the material is not the substrate's or films lie above the masks.
BareFloor bare_floor(const levelset::MaterialStack& stack, const TriangleMesh& surface, int material,
                     const std::vector<int>& masks, double asked);

/// The bare share of the floor of the material at which the step stops; nothing if it stops at none.
std::optional<double> bare_share(const Recipe& recipe, const Step& step, const RunState& state,
                                 const TriangleMesh& surface);

/// Notes the masks at the beginning of a step that stops at a material. A mask, bare or under a film, covers
/// a part of what would be the floor. On an open wafer it is etched at less than half the speed of the fastest
/// material that is seen from above.
/// \note O(n log n) in triangles of the surface.
void note_masks(const Recipe& recipe, const Step& step, const Model& model, const TriangleMesh& surface,
                RunState& state);

/// Notes that a stop condition of the current step holds at this time.
void note_endpoint(const Recipe& recipe, const Step& step, const char* key, const TriangleMesh& surface,
                   RunState& state);

/// When the current step ends, since RunState::epoch: when its duration or, if earlier, its over-etch is
/// over.
double step_end(const Step& step, const RunState& state);

/// How the current step has ended, for the run's history.
/// \param surface  at that time.
StepEnd end_of(const Recipe& recipe, const Step& step, const RunState& state, const TriangleMesh& surface);

/// A line on how a step with a stop condition ended: by its endpoint or before it; empty for other steps.
std::string end_line(const Recipe& recipe, const Step& step, const RunState& state, const StepEnd& end);

}  // namespace sidewall::app
