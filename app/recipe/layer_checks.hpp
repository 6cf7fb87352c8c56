#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

// Checks of a layer's shape against the domain and its grid.
namespace sidewall::app {

// Fewest cells across a shape, and how many are good. Under two, a single node may lie in it, or none. From
// six on, the narrow bands of opposite walls, three cells to either side of each, do not overlap.
inline constexpr double kFewestCells = 2.0, kGoodCells = 6.0;
inline constexpr double kRounding = 1e-9;

/// Checks a shape with walls or a centre. It must lie in the domain and leave part of it free. Its taper must
/// neither close it nor widen it to the whole domain before its end. It and the rest beside it must be at
/// least two cells wide.
///
/// \param layer      any layer; shapes without walls or a centre pass.
/// \param thickness  of the layer, where a recess through it ends; infinite for the first layer.
/// \param path       path of the layer, e.g. "layer[1]".
/// \param notes      receives notes on what is narrower than six cells, and on layers thinner than two.
/// \throws KeyError naming the key to change.
void check_shape(const Layer& layer, double thickness, const levelset::Domain& domain,
                 const std::string& path, std::vector<std::string>& notes);

/// Checks that the file of a mesh layer holds a mesh that meets the domain and can be repaired.
///
/// \param most   largest height above or depth below z = 0.
/// \param notes  receives the repairs.
/// \throws FileError if it is no mesh, KeyError if it lies elsewhere or separates no gas from material.
void check_mesh(const Layer& layer, const levelset::Domain& domain, double most, const std::string& path,
                std::vector<std::string>& notes);

}  // namespace sidewall::app
