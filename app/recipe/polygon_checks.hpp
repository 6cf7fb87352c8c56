#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/polygon.hpp"

namespace sidewall::app {

/// Checks the outlines of a mask, in the recipe's length unit: some edge must lie in the domain. Outlines
/// listed in the recipe must not cross or overlap and must be two cells wide. Outlines of a layout file are
/// united, as is usual, and get a note if they are narrow.
///
/// \param layer  the mask; its position is not yet added to \p polygons.
/// \throws KeyError naming the key to change.
void check_polygons(const Layer& layer, const std::vector<levelset::Polygon>& polygons,
                    const levelset::Domain& domain, const std::string& path, std::vector<std::string>& notes);

/// Checks that an outline does not cross itself.
/// \throws KeyError naming \p key.
void check_outline(const levelset::Polygon& polygon, const std::string& key);

}  // namespace sidewall::app
