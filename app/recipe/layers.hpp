#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/lithography.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::app {

/// Largest height above and depth below z = 0 of a wafer in a recipe, in grid spacings.
inline constexpr double kMostCells = 20'000;

/// One layer of the material stack, bottom up.
struct MaterialLayer {
    int material = 0;  ///< id; -1 if the shape is cut out of the layers below
    levelset::Shape shape;
};

/// The recipe's layers, with stacks expanded into planes.
std::vector<MaterialLayer> expanded_layers(const Recipe& recipe);

/// Number of layers that expanded_layers() returns; opens no file.
std::size_t layer_count(const Recipe& recipe);
std::int64_t layer_count(const Layer& layer);

/// The openings of a step whose model is patterned, for levelset/motion/geometric.hpp.
/// \throws FileError or RecipeError if its layout has changed since the recipe was read.
levelset::Shape pattern_of(const Step& step, const Recipe& recipe);

/// Whether the layer or pattern consists of polygons, listed or from a layout file.
bool has_outlines(const Layer& layer);

/// Makes the layer's file absolute, if it has one.
/// \throws KeyError if there is no such file in \p folder.
void find_file(Layer& layer, const std::filesystem::path& folder);

/// The outlines of a mask in \p length_unit, before they are moved to its position.
/// \param note  if given, receives a remark on the file.
/// \throws KeyError, FileError.
std::vector<levelset::Polygon> drawn_outlines(const Layer& layer, const std::string& length_unit,
                                              std::string* note = nullptr);

/// The outlines that lithography prints of a mask's outlines, which have been moved to their position.
///
/// \param path   path of the layer, e.g. "layer[1]".
/// \param notes  receives how many outlines vanish.
/// \throws KeyError if blur, weights and threshold do not match one another or the domain, or if nothing or
///         everything prints.
std::vector<levelset::Polygon> check_print(const Layer& layer, const std::vector<levelset::Polygon>& placed,
                                           const levelset::Domain& domain, const std::string& path,
                                           std::vector<std::string>& notes);

/// Keys of a layer with its shape.
std::vector<Key> keys_of(Layer& layer);

/// Keys of a step's pattern with its shape; of all shapes if it has none.
std::vector<Key> pattern_keys(Layer& pattern);

/// Words that `shape` accepts.
const std::vector<std::string>& shape_names();

}  // namespace sidewall::app
