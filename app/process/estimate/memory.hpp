#pragma once
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Bytes a run needs at its peak, estimated from the area of its surface to within a factor of about two.
/// Excludes the rays of radiosity, see radiosity_memory.
double estimated_memory(const Recipe& recipe, const levelset::Domain& domain);

/// \param processes  number of processes that each need as much.
/// \throws RecipeError with both figures if the estimate, with the rays of radiosity, exceeds the free
///         memory.
void require_memory(const Recipe& recipe, const levelset::Domain& domain, std::uint32_t processes = 1);

}  // namespace sidewall::app
