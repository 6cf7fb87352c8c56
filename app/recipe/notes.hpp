#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// What a user should know of a valid recipe: names that keys no longer have, how the grid's spacing was
/// rounded, beams that sides mirror, parts that do nothing.
std::vector<std::string> notes_on(const Recipe& recipe);

/// Notes on what a valid recipe says in vain: layers that those below hide wholly, values for materials that a step
/// does not meet, and stop conditions that no wafer of it meets.
std::vector<std::string> idle_parts(const Recipe& recipe);

/// What a user should know of a wafer that is the same along y or round about its middle: that it runs as a profile, or
/// the keys to write for that; else empty.
std::string cheaper_form(const Recipe& recipe);

}  // namespace sidewall::app
