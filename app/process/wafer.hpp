#pragma once
#include <functional>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

// The wafer at a run's start, and the geometric steps, which reshape it at once.
namespace sidewall::app {

/// The state of a run at time 0. Its stack comes from the recipe's layers or from the run that [start] names:
/// bit for bit at the time of that run's checkpoint (for a finished run, its end), else rebuilt from saved
/// surface and interface meshes, which rounds sharp edges within a cell.
/// \param stop  polled often, by any thread; true ends the work, which may take long.
/// \throws Interrupted if \p stop returned true; GeometryError for a shape without a surface; FileError if
///         the earlier run has another domain or length unit, a material that the recipe does not know, or no
///         surface of that time or step (the message lists those it has); RecipeError if a step lacks a value
///         for a material.
RunState initial_state(const Recipe& recipe, const std::function<bool()>& stop = {});

/// Rebuilds the wafer from surface \p number of run.stacks and its interfaces; rounds edges within a cell.
/// \throws FileError if a mesh is missing or damaged; Interrupted if \p stop returned true.
levelset::MaterialStack stack_of_saved(const std::filesystem::path& folder, const RunState& run,
                                       std::size_t number, const levelset::Domain& domain,
                                       const std::function<bool()>& stop = {});

/// Checks that a step has a value for every material on the wafer. The recipe's reader checks the recipe's
/// own materials only; a wafer from another run may hold others.
/// \throws RecipeError naming the key and the material.
void require_values(const Recipe& recipe, const Step& step, const levelset::MaterialStack& stack);

/// z of the lowest point of the substrate's surface, bare or covered; +infinity if nothing is left of it.
double lowest_of_substrate(const levelset::MaterialStack& stack);

/// A warning of the materials of a `strip` step that are not on the wafer or nowhere bare; empty if none.
/// \param number  of the step, from 1.
std::string strip_warning(const Recipe& recipe, const Step& step, std::size_t number,
                          const levelset::MaterialStack& stack);

/// Does a geometric step, which takes no process time.
/// \param step  from expanded_steps.
/// \returns false, without any change, if the step takes time.
/// \throws RecipeError if `planarize` would cut below the whole surface of the substrate.
bool reshape(const Recipe& recipe, const Step& step, levelset::MaterialStack& stack);

}  // namespace sidewall::app
