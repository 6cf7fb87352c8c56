#pragma once
#include "levelset/stack.hpp"

// Process steps that are pure geometry: what a model process would leave, without one.
namespace sidewall::levelset {

/// Takes away everything above z = \p height, as an ideal polish does.
void planarize(MaterialStack& stack, double height);

/// Fills all that is gas below z = \p height with \p material, closed voids included.
void fill(MaterialStack& stack, int material, double height);

/// Takes away every layer of \p material, wherever it is. What lay on it stays where it is.
/// \throws GeometryError if it is the substrate.
void strip(MaterialStack& stack, int material);

/// Adds a film of \p material, \p thickness thick in the direction of every normal: the exact offset of the
/// surface.
void conformal(MaterialStack& stack, int material, double thickness);

}  // namespace sidewall::levelset
