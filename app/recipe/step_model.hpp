#pragma once
#include "app/models/model.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Builds the model of a step, with speeds in the recipe's units. A parsed recipe has it in Step::built.
/// \pre the step is no loop, and its keys are read.
/// \returns for a geometric step a model that traces nothing and has no speed.
/// \throws KeyError if keys that are valid one by one contradict each other, or if a traced beam is tilted
///         towards reflective sides, which would mirror it.
Model make_model(const Step& step, const Materials& materials, const DomainSection& domain);

/// Why species \p k of \p model stays with Monte Carlo under any [flux] method, for a message; empty if
/// radiosity can take it.
std::string why_monte_carlo(const Model& model, std::size_t k);

}  // namespace sidewall::app
