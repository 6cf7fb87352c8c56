#pragma once
#include "app/recipe/recipe.hpp"

// Profiles in x and z: `extent = [10.0]`. The grid is one cell wide along y, and periodic there.
namespace sidewall::app {

/// Whether the domain has an extent along x alone.
bool is_flat(const DomainSection& domain);

/// What volumes are divided by: the strip's width along y in a profile, which makes areas of them; else 1.
double width_of_strip(const Recipe& recipe);

/// The unit of what is left then.
std::string volume_unit(const Recipe& recipe);

/// \throws KeyError, naming the shape to use instead, for a layer or a pattern that ends along y.
void refuse_ends_along_y(const Layer& layer);

}  // namespace sidewall::app
