#pragma once
#include <filesystem>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/polygon.hpp"

namespace sidewall::app {

/// Reads the points of a profile from a CSV file: x and z, in the recipe's length unit, a line. A first line of names, blank lines
/// and what follows a `#` are skipped.
/// \throws FileError naming file and line for anything else, fewer than two points, over a million of them or over 100 MB.
levelset::Polygon read_profile(const std::filesystem::path& path);

/// Checks that the points make a body in the domain: without crossings, on the right side of an axis of revolution, two
/// cells wide and high if it is closed.
/// \param first  nothing lies below the layer.
/// \throws KeyError naming the key that is to be changed.
void check_profile(const Layer& layer, const levelset::Polygon& points, bool first,
                   const levelset::Domain& domain);

}  // namespace sidewall::app
