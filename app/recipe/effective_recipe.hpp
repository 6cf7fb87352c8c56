#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The whole recipe as TOML, with all defaults. It parses to an equal recipe, except for the notes.
std::string effective_recipe(const Recipe& recipe);

/// Differences of two recipes in everything but steps, one text a key: "flux.seed = 2 (there 1)". Materials
/// that \p now has in addition, after those of \p there, do not count.
std::vector<std::string> differences(const Recipe& now, const Recipe& there);

/// Differences of two steps of unrolled loops in everything but names and inner steps.
std::vector<std::string> differences(const Step& now, const Step& there);

}  // namespace sidewall::app
