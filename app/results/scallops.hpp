#pragma once
#include <span>
#include <string>

#include "app/common/json.hpp"
#include "app/recipe/recipe.hpp"
#include "app/results/cut_profile.hpp"

namespace sidewall::app {

/// Scallops that the cycles of an etch have left in a wall; kNone where there are fewer than two edges between them.
struct Scallops {
    double pitch = kNone;  ///< mean distance of neighbouring edges
    double depth = kNone;  ///< peak to valley: of each scallop its deepest place behind the line through its
                           ///< two edges, mean
};

/// Finds scallops by the edges between them, where the wall stands out into the opening. A place that stands out is an edge if
/// it does so by more than 0.05 grid spacings and is not told from noise by a gap: of the heights by which places stand out, put in
/// order, edges are those above the largest ratio of two neighbours.
/// \param openings  at equal distances down the wall; NaN where there is none. A slope of the wall does not count.
/// \param step      between them.
/// \param spacing   of the grid.
/// \note O(n^2) in openings at worst.
Scallops scallops(std::span<const double> openings, double step, double spacing);

/// A note that a recipe's cycles times the pitch of its scallops are not the depth, within a fifth of it: some cycles have
/// left no edge of their own. Empty if they are, if the recipe has no loop, or without these figures.
/// \param metrology  of a summary.
std::string scallop_note(const Recipe& recipe, const Json& metrology);

}  // namespace sidewall::app
