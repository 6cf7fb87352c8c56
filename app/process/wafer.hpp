#pragma once
#include <functional>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"

// The wafer at a run's start, and steps that shape it at once.
namespace sidewall::app {

/// The state of a run at time 0, with the stack of the recipe's layers, or of the run that [start] names: bit for bit
/// where that run's checkpoint stands, as at the end of a finished one; elsewhere made anew from the surface and the
/// interfaces that it saved, which rounds sharp edges within their cell.
/// \param stop  asked often, by any thread; true ends the work, which may take long where cells and layers are many.
/// \throws Interrupted if \p stop said so; GeometryError for a shape without a surface; FileError if the earlier run
///         has another domain or length unit, a material that the recipe does not know, or no surface of that time or
///         step, which names those there are; RecipeError if a step has no value for a material on it.
RunState initial_state(const Recipe& recipe, const std::function<bool()>& stop = {});

/// The wafer of one of the surfaces that a run has saved, as the bodies below each interface and the surface. Sharp edges are
/// rounded within their cell.
/// \param number  of run.stacks.
/// \throws FileError if a mesh is missing or damaged; Interrupted if \p stop said so.
levelset::MaterialStack stack_of_saved(const std::filesystem::path& folder, const RunState& run,
                                       std::size_t number, const levelset::Domain& domain,
                                       const std::function<bool()>& stop = {});

/// Checks that a step has a value for every material on the wafer: the reader checks those of the recipe, and a
/// wafer that comes from elsewhere may hold others.
/// \throws RecipeError naming the key and the material.
void require_values(const Recipe& recipe, const Step& step, const levelset::MaterialStack& stack);

/// z of the lowest point of the substrate's surface, bare or covered; +infinity if nothing is left of it.
double lowest_of_substrate(const levelset::MaterialStack& stack);

/// Warns of materials that a strip does not find, or finds nowhere bare; empty if there are none.
/// \param number  of the step, from 1.
std::string strip_warning(const Recipe& recipe, const Step& step, std::size_t number,
                          const levelset::MaterialStack& stack);

/// Does a geometric step, which happens at once.
/// \param step  of expanded_steps.
/// \returns false, with nothing done, if the step takes time.
/// \throws RecipeError if `planarize` would cut below all of the substrate's surface.
bool reshape(const Recipe& recipe, const Step& step, levelset::MaterialStack& stack);

}  // namespace sidewall::app
