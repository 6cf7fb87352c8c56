#pragma once
#include "app/recipe/recipe.hpp"
#include "levelset/stack.hpp"

namespace sidewall::app {

/// The wafer that [start] names, its materials by the recipe's ids: bit for bit where the earlier run's
/// checkpoint stands, as at the end of a finished one; elsewhere made anew from the surface and the interfaces
/// that it saved, which rounds sharp edges within their cell.
/// \throws FileError if it has another domain or length unit, a material that the recipe does not know, or no
///         surface of that time or step, which names those there are. RecipeError if a step has no value for
///         a material on it.
levelset::MaterialStack stack_of_run(const Recipe& recipe);

}  // namespace sidewall::app
