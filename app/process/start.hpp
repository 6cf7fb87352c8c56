#pragma once
#include <functional>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

namespace sidewall::app {

/// The wafer that [start] names, its materials by the recipe's ids: bit for bit where the earlier run's
/// checkpoint stands, as at the end of a finished one; elsewhere made anew from the surface and the interfaces
/// that it saved, which rounds sharp edges within their cell.
/// \throws FileError if it has another domain or length unit, a material that the recipe does not know, or no
///         surface of that time or step, which names those there are. RecipeError if a step has no value for
///         a material on it. Interrupted if \p stop, asked often while it is made anew, said so.
levelset::MaterialStack stack_of_run(const Recipe& recipe, const std::function<bool()>& stop);

/// initial_state, which may take long where cells and layers are many.
/// \param stop  asked often, by any thread; true ends the work
/// \throws Interrupted if \p stop said so.
RunState initial_state(const Recipe& recipe, const std::function<bool()>& stop);

}  // namespace sidewall::app
