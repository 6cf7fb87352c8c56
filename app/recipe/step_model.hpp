#pragma once
#include "app/models/model.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Builds the model of a step, with its speed in the recipe's units. A parsed recipe holds it already (Step::built).
/// \pre the step is no loop, and its keys are read.
/// \returns a model that traces nothing and has no speed for a geometric step.
/// \throws KeyError where keys that are each right do not fit together, or a traced beam is tilted towards
///         reflective sides, which would mirror it.
Model make_model(const Step& step, const Materials& materials, const DomainSection& domain);

/// The reason, for a message, why species \p k of \p model stays with Monte Carlo whatever [flux] method says; empty if
/// radiosity can take it.
std::string why_monte_carlo(const Model& model, std::size_t k);

}  // namespace sidewall::app
