#pragma once
#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Replaces [cut] by a profile along a line drawn in the first mask's layout: its length becomes the extent
/// of [domain], its parts inside the outlines become the masks.
/// \throws RecipeError if there is no layout, it cannot be read, or it holds no such line.
void take_cut_from_layout(toml::table& root, Recipe& recipe);

/// Replaces `extent = "gds"` of [domain] by the extent of the layout layers that masks name, or of layer 63/0
/// for "gds:63/0", with `padding` and in whole cells. Moves the masks so that the box around them is centred.
/// \throws RecipeError if there is no layout or it cannot be read.
void take_extent_from_layout(toml::table& root, Recipe& recipe);

}  // namespace sidewall::app
