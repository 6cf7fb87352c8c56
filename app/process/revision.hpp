#pragma once
#include <memory>

#include "app/process/state.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Thrown by a run's observer before a time step: the run goes on from there with another recipe, one that
/// require_revision lets pass. The observer is then told of that time step anew.
struct Revised {
    std::shared_ptr<const Recipe> recipe;
};

/// A run that another recipe began may go on with \p recipe: it may trace, coarsen and advect otherwise, and have other
/// values of the step at hand and other steps after it.
/// \throws RecipeError naming what else differs.
void require_revision(const Recipe& recipe, const Recipe& began_with, const RunState& state);

}  // namespace sidewall::app
