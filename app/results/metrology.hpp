#pragma once
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/results/cut_profile.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::app {

/// A named figure of the surface; NaN where it does not exist (no opening at that depth).
struct Measure {
    std::string name;  ///< e.g. "depth", "cd_at_0.5"
    double value = 0.0;
    std::string unit;
};

/// Measures what [metrology] names, in the plane `cut`. An opening is the widest gap in the cut at a height.
///
/// - depth: of the lowest point below z = 0
/// - cd: opening at each of cd_depths
/// - sidewall_angle: of the walls between 25 and 75 % of the depth, 90 = vertical, less = narrowing downwards
/// - bow: widest opening below z = 0 less that just below z = 0
/// - undercut: of the mask, half the opening a grid spacing below mask_bottom less half that just above it
/// - aspect_ratio: depth over the opening at half the depth
/// - scallops: scallop_pitch and scallop_depth, mean distance of the maxima of the opening down the wall, and
///   half the mean of what lies between them and the minima
/// - film: film_top, film_side, film_bottom, thickness of the uppermost layer beside, halfway down and at the
///   floor of what it fills, and step_coverage_side, step_coverage_bottom over film_top: only of a film that can
///   be told from none (levelset::kExposed), in something more than two grid spacings deep that it does not fill
/// - figures by their own name: recipe/figure_names.hpp
///
/// \param surface  as extracted from \p stack. O(n) in triangles.
std::vector<Measure> measure(const Recipe& recipe, const levelset::MaterialStack& stack,
                             const TriangleMesh& surface);

/// Measures with measures, depths and a plane other than the recipe's own.
std::vector<Measure> measure(const Recipe& recipe, const MetrologySection& section,
                             const levelset::MaterialStack& stack, const TriangleMesh& surface);

/// Material id of every layer, from the substrate up.
std::vector<int> layer_materials(const levelset::MaterialStack& stack);

/// Volume of every layer in the domain; the substrate counts from z = 0 down, so that only differences mean
/// something.
std::vector<double> layer_volumes(const levelset::MaterialStack& stack);

/// The film between two profiles of a wafer; kNone where a figure does not exist.
struct Film {
    double top = kNone, side = kNone,
           bottom = kNone;  ///< thickness beside, on the wall halfway down, on the floor
    double depth = kNone;   ///< of what it covers
    bool filled = false;    ///< nothing is open halfway down

    /// Step coverage: thickness at a place over that beside; NaN without a film, or where it covers no walls.
    double coverage(double thickness, double spacing) const;
};

/// Measures the film beside what it covers, halfway down its walls and on its floor. Beside is where the profile begins or, where what the film covers lies over a mirrored or periodic side, in the middle
/// of the material next to it. Where that is flat within 0.02 of the grid spacing \p spacing, the film's bottom is in
/// the middle of the profile, and it has no side. O(n) in segments.
Film film_between(const Profile& surface, const Profile& below, double spacing);

}  // namespace sidewall::app
