#pragma once
#include <limits>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/polygon.hpp"

// Whether a layer's shape makes sense in the domain and on its grid. Included by the recipe's own sources
// only.
namespace sidewall::app {

// A shape under two cells wide has a single node across it, or none. From six on the walls' narrow bands,
// three cells to either side, keep apart.
inline constexpr double kFewestCells = 2.0, kGoodCells = 6.0;
inline constexpr double kRounding = 1e-9;

/// Checks a shape with walls or a centre: it must leave something of the wafer beside it and lie in the domain, its
/// walls must not meet or reach the neighbours before its end, and both it and what is left beside it must be
/// at least two cells wide.
///
/// \param layer      of any shape; others are not looked at.
/// \param thickness  of the layer, infinite for the first one: where a recess through it ends.
/// \param path       of the layer, e.g. "layer[1]".
/// \param notes      takes what is narrower than six cells, and a layer thinner than two.
/// \throws KeyError naming the key that is to be changed.
void check_shape(const Layer& layer, double thickness, const levelset::Domain& domain,
                 const std::string& path, std::vector<std::string>& notes);

/// Checks the outlines of a mask, in the recipe's length unit: edges must lie in the domain. Outlines that the
/// recipe lists itself must not cross or lie in one another and must be two cells wide; those of a layout file
/// are united, as it is usual there, and noted where they are narrow.
///
/// \param layer  the mask, whose position is not yet added to \p polygons.
/// \throws KeyError as check_shape.
/// \note O(corners squared) where outlines lie close to one another.
void check_polygons(const Layer& layer, const std::vector<levelset::Polygon>& polygons,
                    const levelset::Domain& domain, const std::string& path, std::vector<std::string>& notes);

/// Checks that an outline does not cross itself.
/// \throws KeyError naming \p key.
void check_outline(const levelset::Polygon& polygon, const std::string& key);

/// Checks that the file of a mesh layer is a mesh that meets the domain.
///
/// \param most  height above or below z = 0 that it may reach.
/// \throws FileError if it is none, KeyError if it lies elsewhere.
void check_mesh(const Layer& layer, const levelset::Domain& domain, double most);

}  // namespace sidewall::app
