#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The whole recipe as TOML with every default written out. Parses back to an equal recipe, but for the notes.
std::string effective_recipe(const Recipe& recipe);

/// How two recipes differ in all but their steps, a text a key: "flux.seed = 2 (there 1)". Materials that only
/// \p now has, behind the others, are none.
std::vector<std::string> differences(const Recipe& now, const Recipe& there);

/// How two steps of unrolled loops differ in all but their names and in steps of their own.
std::vector<std::string> differences(const Step& now, const Step& there);

}  // namespace sidewall::app
