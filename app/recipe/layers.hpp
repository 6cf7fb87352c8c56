#pragma once
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::app {

/// The height above and the depth below z = 0 to which a recipe may describe a wafer, in grid spacings.
inline constexpr double kMostCells = 20'000;

/// One layer of the material stack, bottom up.
struct MaterialLayer {
    int material = 0;  ///< id; -1 of what is cut out of those below
    levelset::Shape shape;
};

/// The recipe's layers, stacks expanded into planes.
std::vector<MaterialLayer> expanded_layers(const Recipe& recipe);

/// The openings of a step whose model is patterned, for levelset/motion/geometric.hpp.
/// \throws FileError or RecipeError if its layout is not any more what it was when the recipe was read.
levelset::Shape pattern_of(const Step& step, const Recipe& recipe);

}  // namespace sidewall::app
