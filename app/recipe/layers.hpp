#pragma once
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes.hpp"

namespace sidewall::app {

/// How far above and below z = 0 a recipe may describe a wafer, in grid spacings.
inline constexpr double kMostCells = 20'000;

/// One layer of the material stack, bottom up.
struct MaterialLayer {
    int material = 0;  ///< id
    levelset::Shape shape;
};

/// The recipe's layers, stacks expanded into planes.
std::vector<MaterialLayer> expanded_layers(const Recipe& recipe);

}  // namespace sidewall::app
