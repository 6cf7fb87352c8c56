#pragma once
#include "app/recipe/recipe.hpp"

// Profiles in x and z: `extent = [10.0]`. The grid is one cell wide along y, and periodic there.
namespace sidewall::app {

/// Whether the domain has an extent along x alone.
bool is_flat(const DomainSection& domain);

/// The divisor of volumes: the domain's width along y for a profile, which makes areas of them; else 1.
double width_of_strip(const Recipe& recipe);

/// The unit of a volume after that division.
std::string volume_unit(const Recipe& recipe);

/// How far outlines reach along y, in grid spacings, that a profile takes to have no end there.
inline constexpr double kFarAlongY = 50.0;

/// Checks that a layer or a pattern does not end along y, on a grid of that \p spacing.
/// \throws KeyError naming the shape to use instead.
void refuse_ends_along_y(const Layer& layer, double spacing);

}  // namespace sidewall::app
