#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/shapes/lithography.hpp"
#include "levelset/shapes/shapes.hpp"

namespace sidewall::app {

/// The height above and the depth below z = 0 to which a recipe may describe a wafer, in grid spacings.
inline constexpr double kMostCells = 20'000;

/// One layer of the material stack, bottom up.
struct MaterialLayer {
    int material = 0;  ///< id; -1 of what is cut out of those below
    levelset::Shape shape;
};

/// The recipe's layers, stacks expanded into planes.
std::vector<MaterialLayer> expanded_layers(const Recipe& recipe);

/// Number of layers that expanded_layers() gives; opens no file.
std::size_t layer_count(const Recipe& recipe);
std::int64_t layer_count(const Layer& layer);

/// The openings of a step whose model is patterned, for levelset/motion/geometric.hpp.
/// \throws FileError or RecipeError if its layout is not any more what it was when the recipe was read.
levelset::Shape pattern_of(const Step& step, const Recipe& recipe);

/// Whether the layer or pattern is drawn as polygons, listed or in a layout file.
bool drawn(const Layer& layer);

/// Makes the layer's file absolute, if it has one.
/// \throws KeyError if there is no such file in \p folder.
void find_file(Layer& layer, const std::filesystem::path& folder);

/// The outlines that a mask names, in \p length_unit, without its position.
/// \param note  takes what there is to say of its file, if given.
/// \throws KeyError, FileError.
std::vector<levelset::Polygon> drawn_outlines(const Layer& layer, const std::string& length_unit,
                                              std::string* note = nullptr);

/// The outlines that lithography makes of a mask's, which are at their place.
///
/// \param path   of the layer, e.g. "layer[1]".
/// \param notes  takes how many are lost.
/// \throws KeyError if blur, weights and threshold do not fit together or to the domain, or nothing or all of it prints.
std::vector<levelset::Polygon> check_print(const Layer& layer, const std::vector<levelset::Polygon>& placed,
                                           const levelset::Domain& domain, const std::string& path,
                                           std::vector<std::string>& notes);

/// The keys of a layer of its shape.
std::vector<Key> keys_of(Layer& layer);

/// The keys of a step's pattern: those of its shape, or all without one.
std::vector<Key> pattern_keys(Layer& pattern);

/// Words that `shape` accepts.
const std::vector<std::string>& shape_names();

}  // namespace sidewall::app
