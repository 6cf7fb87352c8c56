#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The keys of a layer of its shape.
std::vector<Key> keys_of(Layer& layer);

/// The keys of a step's pattern: those of its shape, or all without one.
std::vector<Key> pattern_keys(Layer& pattern);

/// Words that `shape` accepts.
const std::vector<std::string>& shape_names();

}  // namespace sidewall::app
