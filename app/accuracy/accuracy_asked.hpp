#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// The accuracy that a user asks of one figure.
struct AskedAccuracy {
    std::string measure;    ///< of a summary's metrology
    double bound = 0.0;     ///< in its unit, or a part of its value
    bool relative = false;  ///< a part
    std::string text;       ///< as written
};

/// Reads `MEASURE=BOUND` or `MEASURE=PERCENT%` and makes \p recipe measure them.
/// \throws RecipeError, with the nearest name, for what no run measures or a bound that is not above 0.
std::vector<AskedAccuracy> read_accuracy(const std::vector<std::string>& texts, Recipe& recipe);

}  // namespace sidewall::app
