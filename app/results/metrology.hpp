#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/common/json.hpp"
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
///   the line through their edges (scallops)
/// - film: film_top, film_side, film_bottom, thickness of the uppermost layer beside, halfway down and at the
///   floor of what it fills, and step_coverage_side, step_coverage_bottom over film_top: only of a film that can
///   be told from none (levelset::kExposed), in something more than two grid spacings deep that it does not fill
/// - voids: voids, how many are closed, void_volume in the domain and void_volume_whole with their mirror images,
///   void_top, depth of their highest point below z = 0, and void_width, of the widest (results/figure_values.hpp)
/// - seam_depth: of the upper end of the seam in the uppermost layer, below z = 0 (results/cut_profile.hpp)
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

/// Scallops that the cycles of an etch have left in a wall; kNone where there are fewer than two edges between them.
struct Scallops {
    double pitch = kNone;  ///< mean distance of the edges of neighbouring scallops
    double depth = kNone;  ///< peak to valley: of each scallop its deepest place behind the line through its
                           ///< two edges, mean
};

/// Finds scallops by the edges between them, where the wall stands out into the opening. A place that stands out is an edge if
/// it does so by more than 0.05 grid spacings and is not told from noise by a gap: of the heights by which places stand out, put in
/// order, edges are those above the largest ratio of two neighbours. Of edges nearer than half the usual distance the one that
/// stands out more counts, and where one is missing its scallop still does.
/// \param openings  at equal distances down the wall; NaN where there is none. A slope of the wall does not count.
/// \param step      between them.
/// \param spacing   of the grid.
/// \note O(n^2) in openings at worst.
Scallops scallops(std::span<const double> openings, double step, double spacing);

/// A note that a recipe's cycles times the pitch of its scallops are not the depth, within a fifth of it: some cycles have
/// left no edge of their own; or that the grid is too coarse for their depth. Empty if neither is so, if the recipe has no loop, or
/// without these figures.
/// \param metrology  of a summary.
std::string scallop_note(const Recipe& recipe, const Json& metrology);

}  // namespace sidewall::app
