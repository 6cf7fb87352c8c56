#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

// Names of measured figures: words of [metrology] measures, and names that contain a place or a material.
namespace sidewall::app {

/// The words that [metrology] measures accepts (results/metrology.hpp).
const std::vector<std::string>& measure_names();

enum class FigureKind { opening, width, thickness, wall, recess, ler, lwr, volume, without };

/// A figure at a place or of a material, measured in the plane of [metrology] cut:
///
/// - cd_at_D: widest opening at depth D below z = 0; D < 0 is above z = 0
/// - cd_MATERIAL_at_D: widest stretch of the material at that depth that ends on both sides
/// - thickness_MATERIAL_at_X: thickness of the material along the vertical at X
/// - wall_MATERIAL_at_D: horizontal thickness of the material on the widest opening's walls, mean of both
/// - recess_MATERIAL: (median opening between walls of the material - narrowest opening) / 2, above the floor
/// - ler_at_D, lwr_at_D: three standard deviations, across the cut, of the opening's edges and of its width
/// - volume_MATERIAL: volume in the domain; for the substrate that above z = 0 less what is missing below it
/// - FIGURE_without_MATERIAL: the figure after a strip of the material, if there is any above the substrate
struct Figure {
    std::string name;
    FigureKind kind = FigureKind::opening;
    int material = -1;
    double at = 0.0;    ///< D or X
    int stripped = -1;  ///< material id in FIGURE_without_MATERIAL
    std::string of;     ///< FIGURE in FIGURE_without_MATERIAL
};

/// The figure with that name. No value if \p name has none of these forms or an unknown material.
std::optional<Figure> named_figure(const std::string& name, const Materials& materials);

/// The word of [metrology] measures that makes a run measure a figure. Figures of a place or material are
/// such words themselves; empty if every run's summary has the figure. No value if there is no such figure.
std::optional<std::string> word_of(const Recipe& recipe, const std::string& figure);

/// Whether a figure, or a stop condition on one, is of line roughness, which a profile does not have.
bool is_roughness(const std::string& figure);

/// Checks that \p name is a word of [metrology] measures or a figure.
/// \throws KeyError of \p key with the nearest name.
void require_measure(const Recipe& recipe, const std::string& name, const std::string& key);

/// A stop condition: the step ends once a figure is above or below a value.
struct StopRule {
    std::string figure;
    bool above = true;
    double value = 0.0;
    int bare = -1;  ///< material id if the figure is its bare share of the floor (process/endpoint.hpp)
};

/// Share that `stop_material` asks for: `stop_material = "Si"` means `stop = "bare(Si) > 0.75"`. It is below
/// 1 as the foot of a wall, up to half a cell wide, clears late: in a contact ten cells wide it is a fifth of
/// the floor. An over-etch clears it.
inline constexpr double kBareShare = 0.75;

/// The condition of a step that stops at a bare share, by `stop` or by `stop_material`.
std::optional<StopRule> bare_rule(const Recipe& recipe, const Step& step);

/// Reads a stop condition, e.g. `depth > 2.0` or `bare(Si) > 0.9`.
/// \throws KeyError of "stop" with the reason and the nearest name.
StopRule stop_rule(const Recipe& recipe, const std::string& text);

/// Makes \p recipe measure what a user names: a word of [metrology] measures, such as film, or a figure of a
/// summary's metrology, such as step_coverage_side, mean_rate or cd_at_0.5, which adds the depth.
/// \param option  the option with the name, for messages.
/// \throws RecipeError with the nearest name for what no run measures.
void want_measure(Recipe& recipe, const std::string& name, const std::string& option);

/// Makes \p recipe measure one figure, as want_measure does.
/// \param text  the option's value, for messages.
/// \throws RecipeError as want_measure, and for a word that stands for several figures.
void want_figure(Recipe& recipe, const std::string& name, const std::string& option, const std::string& text);

}  // namespace sidewall::app
