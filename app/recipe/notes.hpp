#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// Notes for the user on a valid recipe: former names of keys, the rounded grid spacing, beams that sides
/// mirror, and parts without effect.
std::vector<std::string> notes_on(const Recipe& recipe);

/// For a wafer that is the same along y or round about its middle: a note that it runs as a profile, or which
/// keys would make it one. Else empty.
std::string cheaper_form(const Recipe& recipe);

}  // namespace sidewall::app
