#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/polygon.hpp"

namespace sidewall::app {

/// Checks the outlines of a mask, in the recipe's length unit: edges must lie in the domain. Outlines that the
/// recipe lists itself must not cross or lie in one another and must be two cells wide; those of a layout file
/// are united, as it is usual there, and noted where they are narrow.
///
/// \param layer  the mask, whose position is not yet added to \p polygons.
/// \throws KeyError naming the key that is to be changed.
void check_polygons(const Layer& layer, const std::vector<levelset::Polygon>& polygons,
                    const levelset::Domain& domain, const std::string& path, std::vector<std::string>& notes);

/// Checks that an outline does not cross itself.
/// \throws KeyError naming \p key.
void check_outline(const levelset::Polygon& polygon, const std::string& key);

}  // namespace sidewall::app
