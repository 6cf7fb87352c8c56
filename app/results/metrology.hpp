#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// A named figure of the surface; NaN where it does not exist (no opening at that depth).
struct Measure {
    std::string name;  ///< e.g. "depth", "cd_at_0.5"
    double value = 0.0;
    std::string unit;
};

/// Measures what [metrology] names, in the plane `cut`. An opening is the widest gap in the cut at a height; closed voids are
/// none.
///
/// - depth: of the lowest point that is open, below z = 0
/// - cd: opening at each of cd_depths
/// - sidewall_angle: of the walls between 25 and 75 % of the depth, 90 = vertical, less = narrowing downwards
/// - bow: widest opening below z = 0 less that just below z = 0
/// - undercut: of the mask, half the opening a grid spacing below mask_bottom less half that just above it
/// - aspect_ratio: depth over the opening at half the depth
/// - scallops: scallop_pitch and scallop_depth, mean distance of the edges between scallops and how deep those are behind
///   the line through their edges (results/scallops.hpp)
/// - film: film_top, film_side, film_bottom, thickness of the uppermost layer beside, halfway down and at the
///   floor of what it fills, and step_coverage_side, step_coverage_bottom over film_top: only of a film that can
///   be told from none (levelset::kExposed), in something more than two grid spacings deep that it does not fill
/// - voids: voids, how many are closed, void_volume in the domain and void_volume_whole with their mirror images,
///   void_top, depth of their highest point below z = 0, and void_width, of the widest (results/voids.hpp)
/// - seam_depth: of the upper end of the seam in the uppermost layer, below z = 0 (results/film.hpp)
/// - figures by their own name: recipe/figure_names.hpp
///
/// \param surface  as extracted from \p stack. O(n) in triangles.
std::vector<Measure> measure(const Recipe& recipe, const levelset::MaterialStack& stack,
                             const TriangleMesh& surface);

/// Measures with measures, depths and a plane other than the recipe's own.
std::vector<Measure> measure(const Recipe& recipe, const MetrologySection& section,
                             const levelset::MaterialStack& stack, const TriangleMesh& surface);

/// Any one figure of measure() by its name; NaN if no recipe measures that.
Measure measure_named(const Recipe& recipe, const std::string& name, const levelset::MaterialStack& stack,
                      const TriangleMesh& surface);

/// Material id of every layer, from the substrate up.
std::vector<int> layer_materials(const levelset::MaterialStack& stack);

/// Volume of every layer in the domain; the substrate counts from z = 0 down, so that only differences mean
/// something.
std::vector<double> layer_volumes(const levelset::MaterialStack& stack);

}  // namespace sidewall::app
