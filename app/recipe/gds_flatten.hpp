#pragma once
#include <string>
#include <vector>

#include "app/recipe/gds.hpp"

namespace sidewall::app {

/// All polygons of a layer and datatype in \p cell and the cells it refers to, in metres.
/// \throws FileError naming the file for an unknown cell, references in a circle, a polygon over a kilometre
///         from the origin, and, before anything is placed, for over 10 million cells placed, 2 million polygons or
///         20 million corners. The hierarchy may be of any depth.
std::vector<levelset::Polygon> flatten(const GdsLibrary& library, const std::string& cell, int layer,
                                       int datatype);

}  // namespace sidewall::app
