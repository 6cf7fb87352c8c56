#pragma once
#include "app/recipe/figures.hpp"
#include "app/results/metrology.hpp"

namespace sidewall::app {

/// A figure at a place or of a material, in the plane of [metrology] cut; NaN where it does not exist.
///
/// \param surface  as extracted from \p stack. O(n) in triangles, but ler and lwr, which cut once a cell along the
///                 line: O(n cells).
Measure measure_figure(const Recipe& recipe, const Figure& figure, const levelset::MaterialStack& stack,
                       const TriangleMesh& surface);

/// Any one figure of measure() by its name; NaN if no recipe measures that.
Measure measure_named(const Recipe& recipe, const std::string& name, const levelset::MaterialStack& stack,
                      const TriangleMesh& surface);

}  // namespace sidewall::app
