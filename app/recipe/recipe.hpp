#pragma once
#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/schema/keys.hpp"
#include "levelset/domain.hpp"
#include "levelset/motion/advection_options.hpp"
#include "surface/cut.hpp"

namespace sidewall::app {

struct Model;

enum class Symmetry : std::uint8_t { none, axial };

/// How to run a wafer that is a thin strip along y: as a profile, in space, or decided automatically.
enum class Strip : std::uint8_t { automatic, profile, space };

struct DomainSection {
    std::array<double, 2> extent{};  ///< lateral lengths along x and y, centred on 0
    double grid_spacing = 0.0;       ///< as requested; domain_of() rounds it
    std::optional<double> padding;   ///< margin around layouts; a parsed recipe has it in its extent instead
    std::array<levelset::Side, 2> boundary{levelset::Side::reflective, levelset::Side::reflective};
    Symmetry symmetry = Symmetry::none;
    Strip strip = Strip::automatic;  ///< a parsed recipe has profile where automatic chose it
    std::string length_unit = "um";
    std::string time_unit = "s";
    bool operator==(const DomainSection&) const = default;
};

struct GridSection {
    std::optional<double> levels = 1.0;  ///< 1 to 3; no value: as many as pay (grid_levels)
    bool operator==(const GridSection&) const = default;
};

/// An earlier run whose final or saved wafer replaces the layers. The new run's process time starts at 0.
struct StartSection {
    std::string from;            ///< folder of that run, absolute in a parsed recipe; empty: none
    std::optional<double> time;  ///< process time in that run; no value: its end
    std::int64_t step = 0;       ///< or the step at whose end, from 1 with loops unrolled; 0: by time
    bool operator==(const StartSection&) const = default;
};

/// A polygon listed in the recipe.
struct Outline {
    std::vector<double> points;  ///< x and y of each corner
    bool operator==(const Outline&) const = default;
};

/// A layer as the recipe writes it. Its shape decides which members count (levelset/shapes/shapes.hpp).
struct Layer {
    std::string shape = "plane";
    std::string material;
    /// z of the flat surface; a parsed recipe has it, except for a stack, mesh, sphere, cylinder or gap.
    std::optional<double> top;
    std::optional<double> thickness;  ///< above the layer below, instead of top; a parsed recipe never has it
    std::array<double, 2> position{};
    double width = 0.0;
    double radius = 0.0;
    std::optional<double> depth;  ///< no value: through the layer
    double height = 0.0;
    std::array<double, 2> size{};
    double taper_deg = 0.0;
    std::string file;               ///< mesh, mask; absolute in a parsed recipe
    std::vector<Outline> polygons;  ///< mask: listed in the recipe
    std::string cell;               ///< mask: cell of the layout file; empty: its only top cell
    std::int64_t gds_layer = 0, gds_datatype = 0;
    std::vector<double> blur,
        blur_weights;  ///< mask: sigmas of its outlines' blur, and their weights; none: as drawn
    std::optional<double> blur_threshold;  ///< mask: contour level of the blur; no value: 0.5
    bool openings = true;                  ///< mask: the polygons are open, else solid
    std::vector<std::string> materials;    ///< stack: one period, bottom up
    std::vector<double> thicknesses;       ///< stack: one for each material
    std::int64_t repeat = 1;               ///< stack: number of periods
    bool subtract = false;                 ///< cut out of the layers below, instead of added; has no material
    std::optional<double> z;       ///< sphere, cylinder, gap: z of the centre; always set in a parsed recipe
    std::string axis = "y";        ///< cylinder
    std::optional<double> length;  ///< cylinder, gap; no value: through the domain
    std::optional<double> span;    ///< gap: length along y; no value: through the domain
    std::string sweep = "extrusion";  ///< profile
    std::optional<double> base;       ///< mask: z of its underside; no value: it stands on what is below
    bool operator==(const Layer&) const = default;
};

/// One process step, or a loop over steps.
struct Step {
    std::string model;      ///< empty for a loop
    std::string name;       ///< name in reports; empty: the model's name
    std::string chemistry;  ///< deck that provided keys (decks.hpp); not stored
    double duration = 0.0;  ///< upper bound if there is a stop condition (process/time_step.hpp)
    std::optional<double> stop_depth, stop_thickness;
    std::string stop_material;
    std::string stop;  ///< condition on a figure, such as "depth > 2.0" or "bare(Si) > 0.9"
    double over_etch = 0.0, over_etch_time = 0.0;  ///< time after the stop: as share of that before; as time
    std::int64_t repeat = 1;
    std::any parameters;                 ///< the model's parameter struct, which its keys fill (ModelEntry)
    Layer pattern{.shape = "polygons"};  ///< openings seen from above, for patterned models
    std::vector<Step> steps;             ///< steps that a loop repeats
    std::shared_ptr<const Model> built;  ///< model of a parsed step that takes time
    bool operator==(const Step& other) const;  ///< equal if all keys have equal values
};

struct FluxSection {
    std::string method = "auto";  ///< monte-carlo, radiosity, or auto
    double accuracy = 0.01;       ///< standard error, as a share, that noise may cause in what a step moves
    std::int64_t rays = 0;        ///< source rays a species and time step, in place of accuracy; 0: not given
    std::optional<double> relative_error;   ///< error of each time step's fluxes, in place of accuracy
    std::int64_t max_rays = 1'000'000'000;  ///< upper bound under accuracy or relative_error
    std::int64_t batches = 32;              ///< independent parts, whose scatter gives the errors
    std::int64_t seed = 1;
    double memory = 2.0;     ///< GB for radiosity's exchange samples
    double reuse = 0.0;      ///< fluxes are reused until they change by this share; 0: traced every time step
    double averaging = 0.0;  ///< radius within which fluxes are averaged over the surface; 0: as traced
    std::string stages = "step";  ///< traced at a time step's start ("step") or at "all" its stages
    bool operator==(const FluxSection&) const = default;
    bool by_accuracy() const { return rays == 0 && !relative_error; }
    /// Upper bound of rays a species and time step; by accuracy: a million at 1 % or worse.
    std::int64_t most_rays() const {
        const double by_accuracy = 1e6 * std::max(1.0, std::pow(0.01 / accuracy, 2.0));
        if (relative_error) return max_rays;
        return rays != 0 ? rays
                         : static_cast<std::int64_t>(std::min(static_cast<double>(max_rays), by_accuracy));
    }
};

/// Lengths in the recipe's unit; no value is "auto", a multiple of dx (simplify/simplify_options.hpp).
struct SimplifySection {
    std::string method = "auto";  ///< auto: region-bounded where it pays (process/arriving/traced_mesh.hpp)
    std::optional<double> l0, step, l_max;
    std::optional<double> feature_parameter = 0.5;  ///< no value: from the curvature's distribution
    std::vector<double> weights;       ///< of volume, boundary, shape; empty: the method's defaults
    std::int64_t target_vertices = 0;  ///< 0: none
    std::optional<double> max_error;   ///< hard bound of the distance; not for CGAL's method
    double flux_change = 0.1;          ///< region-bounded: relative change of flux along an edge; 0: any
    bool operator==(const SimplifySection&) const = default;
};

struct OutputSection {
    std::optional<double> every;  ///< process time between saved surfaces; no value: at the end of each step
    std::vector<std::string> profiles;
    bool operator==(const OutputSection&) const = default;
};

struct MetrologySection {
    std::vector<std::string> measures{"depth"};
    std::vector<double> cd_depths;  ///< below z = 0
    double mask_bottom = 0.0;       ///< z below which undercut is measured
    std::string cut = "y=0";
    bool operator==(const MetrologySection&) const = default;
};

/// A recipe with every default filled in and every rule checked, as parse_recipe returns it.
struct Recipe {
    std::string file;
    DomainSection domain;
    GridSection grid;
    StartSection start;
    Materials materials = default_materials();
    std::vector<Layer> layers;  ///< none if the run starts from another
    std::vector<Step> steps;
    FluxSection flux;
    SimplifySection simplify;
    levelset::AdvectionOptions advection;
    OutputSection output;
    MetrologySection metrology;
    std::vector<std::string> notes;  ///< from the reader, e.g. on keys under former names
    bool operator==(const Recipe&) const = default;
};

/// Parses and validates a recipe, and fills in all defaults.
///
/// \param text       TOML, whose sections and keys `sidewall models` lists.
/// \param file       its name, for messages; other files are searched in its folder.
/// \param overrides  `key=value` settings such as `step[0].duration=2`, applied in order before validation.
///                   The value is TOML; a bare word is a string.
/// \throws RecipeError naming file and line (or the override), key, value, the rule and what to do.
Recipe parse_recipe(std::string_view text, const std::string& file,
                    const std::vector<std::string>& overrides = {});

/// Reads and validates the recipe in a file.
/// \throws FileError if it cannot be read, RecipeError as parse_recipe.
Recipe load_recipe(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// Reads only the domain, materials and metrology of a recipe file. Files that it names may be missing.
/// \throws FileError, RecipeError as load_recipe.
Recipe load_frame(const std::filesystem::path& path);

/// The simulation domain of a recipe, with the spacing rounded to divide both extents.
levelset::Domain domain_of(const Recipe& recipe);

/// The steps in running order, loops unrolled, with repeat 1 and names such as "2.1 etch (cycle 3 of 10)".
std::vector<Step> expanded_steps(const Recipe& recipe);

/// Whether the step has a stop condition.
bool has_stop(const Step& step);

/// The sum of the durations of unrolled steps.
double total_duration(const std::vector<Step>& steps);

/// The planes of [output] profiles.
std::vector<surface::Plane> profile_planes(const Recipe& recipe);

}  // namespace sidewall::app
