#pragma once
#include <span>

#include "levelset/layers/stack.hpp"
#include "levelset/shapes/shapes.hpp"

// Process steps as pure geometry, without a model. Stacks have one level (levelset/layers/levels.hpp).
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

/// Adds a film of \p material with openings: its top is flat, \p thickness above the highest point (spin-on),
/// or it is conformal as by conformal(). It is removed where \p pattern is open (levelset/shapes/outline.hpp;
/// the pattern's top is not read). Closed voids stay gas.
/// \throws GeometryError for a pattern that is no outline.
void mask(MaterialStack& stack, int material, const Shape& pattern, double thickness, bool conformal);

/// Takes away the layers of \p materials within \p pattern above z = \p bottom, which may be minus infinity.
/// What lies on them stays where it is.
/// \throws GeometryError as mask(), or if the substrate has to go and there is no bottom.
void cut(MaterialStack& stack, std::span<const int> materials, const Shape& pattern, double bottom);

}  // namespace sidewall::levelset
