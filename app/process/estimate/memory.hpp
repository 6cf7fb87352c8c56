#pragma once
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Bytes a run will need at its peak, from the area of its surface: an estimate within a factor of about two.
/// Without the rays of radiosity, see radiosity_memory.
double estimated_memory(const Recipe& recipe, const levelset::Domain& domain);

/// \param processes  that each need as much.
/// \throws RecipeError with both figures if the estimate, or the rays that radiosity may take beside it, exceed
///         the memory that is free.
void require_memory(const Recipe& recipe, const levelset::Domain& domain, std::uint32_t processes = 1);

}  // namespace sidewall::app
