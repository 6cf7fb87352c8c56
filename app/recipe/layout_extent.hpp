#pragma once
#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Replaces [cut] by a profile along a line that the layout of the first mask holds: the extent of [domain] by its length,
/// the masks' layouts by the parts of the line in them.
/// \throws RecipeError where a layout cannot be read, there is none or it holds no such line.
void take_cut_from_layout(toml::table& root, Recipe& recipe);

/// Replaces `extent = "gds"` of [domain] by the extent of the layouts' layers that masks name, or of the layer that
/// `extent = "gds:63/0"` names, with `padding` around
/// them and in whole cells, and moves these masks so that the layouts' centre is the domain's.
/// \throws RecipeError where a layout cannot be read or there is none.
void take_extent_from_layout(toml::table& root, Recipe& recipe);

}  // namespace sidewall::app
