#pragma once
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes.hpp"

namespace sidewall::app {

/// One layer of the material stack, bottom up.
struct MaterialLayer {
    int material = 0;  ///< id
    levelset::Shape shape;
};

/// The recipe's layers, stacks expanded into planes.
std::vector<MaterialLayer> expanded_layers(const Recipe& recipe);

}  // namespace sidewall::app
