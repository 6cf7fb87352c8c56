#pragma once
#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Replaces `extent = "gds"` of [domain] by the extent of the layouts' layers that masks name, with `padding` around
/// them and in whole cells, and moves these masks so that the layouts' centre is the domain's.
/// \throws RecipeError where a layout cannot be read or there is none.
void take_extent_from_layout(toml::table& root, Recipe& recipe);

}  // namespace sidewall::app
