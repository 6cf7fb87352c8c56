#pragma once
#include <set>
#include <string>
#include <vector>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// All polygons of a layer and datatype in \p cell and the cells it refers to, in metres.
/// \param missing  takes the names of cells that are referred to and that the file lacks; nothing is drawn of them.
/// \throws FileError naming the file for an unknown cell, references in a circle, a polygon over a kilometre
///         from the origin, and, before anything is placed, for over 10 million cells placed, 2 million polygons or
///         20 million corners. The hierarchy may be of any depth.
std::vector<levelset::Polygon> flatten(const Layout& layout, const std::string& cell, int layer, int datatype,
                                       std::set<std::string>& missing);

}  // namespace sidewall::app
