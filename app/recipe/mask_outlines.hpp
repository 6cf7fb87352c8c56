#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/lithography.hpp"

// The outlines of a mask: polygons of the recipe or of a layout, as drawn or blurred by lithography.
namespace sidewall::app {

/// Whether the layer or pattern is drawn as polygons, listed or in a layout file.
bool drawn(const Layer& layer);

/// Makes the layer's file absolute, if it has one.
/// \throws KeyError if there is no such file in \p folder.
void find_file(Layer& layer, const std::filesystem::path& folder);

/// The outlines that a mask names, in \p length_unit, without its position.
/// \throws KeyError, FileError.
std::vector<levelset::Polygon> drawn_outlines(const Layer& layer, const std::string& length_unit);

/// The blur of a mask's outlines; nothing if they are as drawn.
std::optional<levelset::Blur> blur_of(const Layer& layer);

/// The outlines that lithography makes of a mask's, which are at their place.
///
/// \param path   of the layer, e.g. "layer[1]".
/// \param notes  takes how many are lost.
/// \throws KeyError if blur, weights and threshold do not fit together or to the domain, or nothing or all of it prints.
std::vector<levelset::Polygon> check_print(const Layer& layer, const std::vector<levelset::Polygon>& placed,
                                           const levelset::Domain& domain, const std::string& path,
                                           std::vector<std::string>& notes);

}  // namespace sidewall::app
