#pragma once
#include <cstddef>
#include <span>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// Volume that is left of a layer, counted until it reaches \p enough. Counts the nodes of its band where the layer is
/// thicker than thinnest_film, below which it cannot be resolved; a thick layer holds more.
/// \param start  in: where to begin, any number; out: where it was found, the place to begin the next time.
/// \returns what is left, or as much as was counted when it was enough.
/// \note O(1) while there is enough where the search begins, else O(n) at most.
double volume_left(const MaterialStack& stack, std::size_t layer, double enough, std::size_t& start);

/// Removes buried layers of which less than a cell of the finest level is left, the substrate excepted: what is left
/// belongs to the layer above. Such a layer costs time in every later step, and its mesh would be of scraps.
/// \param volumes  by layer, between its front and that of the layer below: a film too thin for the grid still has a volume here, and stays.
/// \returns whether there were any.
bool drop_spent_layers(MaterialStack& stack, std::span<const double> volumes);

}  // namespace sidewall::levelset
