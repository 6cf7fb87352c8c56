#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Notes on what a valid recipe says in vain: layers that those below hide wholly, values for materials that a step
/// does not meet, and stop conditions that no wafer of it meets.
std::vector<std::string> idle_parts(const Recipe& recipe);

}  // namespace sidewall::app
