#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

// The names of measured figures: words of [metrology] measures, and names that hold a place or a material.
namespace sidewall::app {

/// The words that [metrology] measures accepts (results/metrology.hpp).
const std::vector<std::string>& measure_names();

enum class FigureKind { opening, width, thickness, wall, recess, ler, lwr, volume, without };

/// A figure at a place or of a material, in the plane of [metrology] cut:
///
/// - cd_at_D: the widest opening at depth D below z = 0 (above it, with D < 0)
/// - cd_MATERIAL_at_D: the widest stretch of the material at that depth that ends on both sides
/// - thickness_MATERIAL_at_X: of the material along the vertical at X
/// - wall_MATERIAL_at_D: horizontally, of the material on the walls of the widest opening at a depth, mean of both
/// - recess_MATERIAL: how far the material, where it is on both walls of the opening, stands back behind its narrowest place, by the median of its heights above the floor
/// - ler_at_D, lwr_at_D: three standard deviations, across the cut, of the opening's edges and of its width
/// - volume_MATERIAL: in the domain; of the substrate above z = 0, less what is missing below
/// - FIGURE_without_MATERIAL: any figure of the wafer as it were after a strip of the material, if it has it above its substrate
struct Figure {
    std::string name;
    FigureKind kind = FigureKind::opening;
    int material = -1;
    double at = 0.0;    ///< D or X
    int stripped = -1;  ///< of FIGURE_without_MATERIAL
    std::string of;     ///< the FIGURE there
};

/// The figure of that name; nothing if \p name has none of these forms or names an unknown material.
std::optional<Figure> named_figure(const std::string& name, const Materials& materials);

/// The word of [metrology] measures that lets a run measure a figure, which is the figure's own name if it names a place or
/// a material; empty: every run's summary has it. Nothing if there is no such figure.
std::optional<std::string> word_of(const Recipe& recipe, const std::string& figure);

/// Whether a figure, or a stop condition on one, is of line roughness, of which a profile has none.
bool is_roughness(const std::string& figure);

/// Checks that \p name is a word of [metrology] measures or a figure.
/// \throws KeyError of \p key, with the nearest name.
void require_measure(const Recipe& recipe, const std::string& name, const std::string& key);

/// The end of a message on an unknown figure: `; did you mean NAME?`, or what else to do.
std::string nearest_figure(const Recipe& recipe, const std::string& name);

/// A stop condition: the step ends once a figure is above or below a value.
struct StopRule {
    std::string figure;
    bool above = true;
    double value = 0.0;
    int bare =
        -1;  ///< the figure is the share of the floor that is bare of this material (process/endpoint.hpp)
};

/// The share that `stop_material` asks for: `stop_material = "Si"` is `stop = "bare(Si) > 0.75"`. The foot of a wall, up to
/// half a cell wide, stays longer: of a contact ten cells across it holds a fifth of the floor. An over-etch clears it.
inline constexpr double kBareShare = 0.75;

/// The stop condition of a step that stops at a material, be it by `stop` or by `stop_material`.
std::optional<StopRule> bare_rule(const Recipe& recipe, const Step& step);

/// Reads a stop condition, e.g. `depth > 2.0` or `bare(Si) > 0.9`.
/// \throws KeyError of "stop" saying what is wrong, with the nearest name.
StopRule stop_rule(const Recipe& recipe, const std::string& text);

/// Makes \p recipe measure what a user names: a word of [metrology] measures, such as film, or one of the figures
/// in a summary's metrology, such as step_coverage_side, cd_at_0.5 (which adds the depth), mean_rate.
/// \param option  that names it, for messages.
/// \throws RecipeError, with the nearest name, for what no run measures.
void want_measure(Recipe& recipe, const std::string& name, const std::string& option);

/// Whether \p name is one figure, not a word that stands for several.
bool is_figure(const Recipe& recipe, const std::string& name);

/// Makes \p recipe measure one figure, as want_measure.
/// \param text  the option's value, for messages.
/// \throws RecipeError, too, for a word that stands for several figures.
void want_figure(Recipe& recipe, const std::string& name, const std::string& option, const std::string& text);

}  // namespace sidewall::app
