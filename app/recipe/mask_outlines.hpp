#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"
#include "levelset/shapes/lithography.hpp"

// What a mask names: polygons of the recipe or of a layout, as drawn or as printed. Included by the recipe's
// own sources only.
namespace sidewall::app {

/// Whether the layer or pattern is drawn as polygons, listed or in a layout file.
bool drawn(const Layer& layer);

/// Makes the layer's file absolute, if it has one.
/// \throws KeyError if there is no such file in \p folder.
void find_file(Layer& layer, const std::filesystem::path& folder);

/// The outlines that a mask names, in \p length_unit, without its position.
/// \throws KeyError, FileError.
std::vector<levelset::Polygon> drawn_outlines(const Layer& layer, const std::string& length_unit);

/// How a mask's outlines are blurred; nothing if they are not.
std::optional<levelset::Blur> blur_of(const Layer& layer);

/// What prints of a mask's outlines, which are at their place.
///
/// \param path   of the layer, e.g. "layer[1]".
/// \param notes  takes how many are lost.
/// \throws KeyError if blur, weights and threshold do not fit together or to the domain, or nothing or all of it prints.
std::vector<levelset::Polygon> check_print(const Layer& layer, const std::vector<levelset::Polygon>& placed,
                                           const levelset::Domain& domain, const std::string& path,
                                           std::vector<std::string>& notes);

/// Replaces `extent = "gds"` of [domain] by the extent of the layouts' layers that masks name, with `padding` around
/// them and in whole cells, and moves these masks so that the layouts' centre is the domain's.
/// \throws RecipeError where a layout cannot be read or there is none.
void take_extent_from_layout(toml::table& root, Recipe& recipe);

}  // namespace sidewall::app
