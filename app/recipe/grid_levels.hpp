#pragma once
#include "app/recipe/recipe.hpp"
#include "levelset/domain.hpp"

namespace sidewall::app {

/// How many levels the grid of a recipe has: as [grid] says; "auto": up to 3, while the cells along both sides divide and
/// kFewestCoarse of the coarsest are left.
int grid_levels(const Recipe& recipe, const levelset::Domain& domain);

/// Cells of the coarsest level along the shorter side below which "auto" adds none: columns of 16 finest cells around
/// features would leave little to be coarse.
inline constexpr int kFewestCoarse = 24;

/// \throws KeyError if [grid] asks for levels that the domain cannot have; it names a spacing that does.
void check_grid(const GridSection& grid, const DomainSection& domain);

}  // namespace sidewall::app
