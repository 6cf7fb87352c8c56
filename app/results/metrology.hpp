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

/// Measures what [metrology] names, in its plane `cut`. An opening is the widest gap at a height, no void.
///
/// - depth: of the lowest open point, below z = 0
/// - cd: opening at each of cd_depths
/// - sidewall_angle: of the walls between 25 and 75 % of the depth, 90 = vertical, less = narrowing downwards
/// - bow: widest opening below z = 0 less that a grid spacing below z = 0
/// - undercut: half the opening a grid spacing below mask_bottom less half the mask's opening just above it
/// - aspect_ratio: depth over the opening at half the depth
/// - scallops: scallop_pitch, mean distance of the edges between scallops, and scallop_depth, mean depth
///   behind the line through their edges (scallops())
/// - film: film_top, film_side, film_bottom: thickness of the uppermost layer beside an opening, on its wall
///   halfway down and on its floor; step_coverage_side, step_coverage_bottom: the latter over film_top, for
///   films over levelset::kExposed cells thick in what is over two grid spacings deep and not filled
/// - voids: voids, their number; void_volume in the domain and void_volume_whole with mirror images;
///   void_top, depth of the highest point below z = 0; void_width, of the widest (results/figure_values.hpp)
/// - seam_depth: of the upper end of the seam in the uppermost layer, below z = 0 (results/cut_profile.hpp)
/// - any figure by its name: recipe/figure_names.hpp
///
/// \param surface  as extracted from \p stack. O(n) in triangles.
std::vector<Measure> measure(const Recipe& recipe, const levelset::MaterialStack& stack,
                             const TriangleMesh& surface);

/// Measures what \p section names, at its depths and in its plane, instead of the recipe's [metrology].
std::vector<Measure> measure(const Recipe& recipe, const MetrologySection& section,
                             const levelset::MaterialStack& stack, const TriangleMesh& surface);

/// Whether JSON lists a figure. Those that do not exist are null in it, but step coverages are left out.
bool is_listed(const Measure& measure);

/// Measures one figure of measure() by its name; NaN if there is no such figure.
Measure measure_named(const Recipe& recipe, const std::string& name, const levelset::MaterialStack& stack,
                      const TriangleMesh& surface);

/// Material id of every layer, from the substrate up.
std::vector<int> layer_materials(const levelset::MaterialStack& stack);

/// Volume of every layer in the domain. The substrate's is that above z = 0 less what is missing below: only
/// differences have a meaning.
std::vector<double> layer_volumes(const levelset::MaterialStack& stack);

/// Scallops that the cycles of an etch have left in a wall; kNone with fewer than two edges between them.
struct Scallops {
    double pitch = kNone;  ///< mean distance of the edges of neighbouring scallops
    double depth = kNone;  ///< peak to valley: deepest place of a scallop behind the line through its two
                           ///< edges, mean of all
};

/// Finds scallops by the edges between them, where the wall stands out into the opening by over 0.05 grid
/// spacings. Noise is separated by a gap: with all heights in falling order, edges are those before the
/// largest ratio of two neighbours. Of edges closer than half the median distance only the highest counts.
/// Where an edge is missing, the pitch counts its scallop all the same.
/// \param openings  at equal distances down the wall; NaN where there is none. Their slope is subtracted.
/// \param step      distance between two openings.
/// \param spacing   of the grid.
/// \note O(n^2) in openings at worst.
Scallops scallops(std::span<const double> openings, double step, double spacing);

/// A note for the user if the recipe's cycles times the scallop pitch differ from the depth by over a fifth,
/// as some cycles left no edge, or if scallops are under eight cells high, too few for their depth. Empty if
/// neither is so, the recipe has no loop, or the figures are missing.
/// \param metrology  of a summary.
std::string scallop_note(const Recipe& recipe, const Json& metrology);

}  // namespace sidewall::app
