#pragma once
#include <limits>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

// Checks of a layer's shape against the domain and its grid.
namespace sidewall::app {

// A shape under two cells wide has a single node across it, or none. From six on the walls' narrow bands,
// three cells to either side, keep apart.
inline constexpr double kFewestCells = 2.0, kGoodCells = 6.0;
inline constexpr double kRounding = 1e-9;

/// Checks a shape with walls or a centre: it must leave something of the wafer beside it and lie in the domain, its
/// walls must not meet or reach the neighbours before its end, and both it and what is left beside it must be
/// at least two cells wide.
///
/// \param layer      of any shape; those without walls or a centre pass.
/// \param thickness  of the layer, infinite for the first one: where a recess through it ends.
/// \param path       of the layer, e.g. "layer[1]".
/// \param notes      takes what is narrower than six cells, and a layer thinner than two.
/// \throws KeyError naming the key that is to be changed.
void check_shape(const Layer& layer, double thickness, const levelset::Domain& domain,
                 const std::string& path, std::vector<std::string>& notes);

/// Checks that the file of a mesh layer is a mesh that meets the domain and can be mended.
///
/// \param most   height above or below z = 0 that it may reach.
/// \param notes  takes what was mended.
/// \throws FileError if it is none, KeyError if it lies elsewhere or does not tell gas from material.
void check_mesh(const Layer& layer, const levelset::Domain& domain, double most, const std::string& path,
                std::vector<std::string>& notes);

}  // namespace sidewall::app
