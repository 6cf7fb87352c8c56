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

/// How a wafer is run that is a thin strip along y.
enum class Strip : std::uint8_t { automatic, profile, space };

struct DomainSection {
    std::array<double, 2> extent{};  ///< lateral x, y lengths, centred on 0
    double grid_spacing = 0.0;       ///< as wanted; domain_of() rounds it
    std::optional<double> padding;   ///< around layouts; absent in a parsed recipe, whose extent includes it
    std::array<levelset::Side, 2> boundary{levelset::Side::reflective, levelset::Side::reflective};
    Symmetry symmetry = Symmetry::none;
    Strip strip = Strip::automatic;  ///< in a parsed recipe profile wherever that is what automatic comes to
    std::string length_unit = "um";
    std::string time_unit = "s";
    bool operator==(const DomainSection&) const = default;
};

struct GridSection {
    std::optional<double> levels = 1.0;  ///< 1 to 3; absent: as many as pay (recipe/domain.hpp)
    bool operator==(const GridSection&) const = default;
};

/// The earlier run whose wafer takes the place of layers; the new run's process time begins at 0.
struct StartSection {
    std::string from;            ///< its folder, absolute in a parsed recipe; empty: none
    std::optional<double> time;  ///< process time there; absent: where it ended
    std::int64_t step = 0;       ///< at whose end, from 1 with loops unrolled; 0: by time
    bool operator==(const StartSection&) const = default;
};

/// A polygon that the recipe lists.
struct Outline {
    std::vector<double> points;  ///< x and y of the corners in turn
    bool operator==(const Outline&) const = default;
};

/// A layer as the recipe writes it. Which members count depends on the shape; see recipe/layers.cpp and
/// levelset/shapes/shapes.hpp.
struct Layer {
    std::string shape = "plane";
    std::string material;
    std::optional<double> top;  ///< z of the flat surface; always set in a parsed recipe, except for a stack
    std::optional<double> thickness;  ///< above the layer below, instead of top; never set in a parsed recipe
    std::array<double, 2> position{};
    double width = 0.0;
    double radius = 0.0;
    std::optional<double> depth;  ///< absent: through the layer
    double height = 0.0;
    std::array<double, 2> size{};
    double taper_deg = 0.0;
    std::string file;               ///< mesh, mask; absolute in a parsed recipe
    std::vector<Outline> polygons;  ///< mask: in the recipe
    std::string cell;               ///< mask: of the file; its only top cell if empty
    std::int64_t gds_layer = 0, gds_datatype = 0;
    std::vector<double> blur,
        blur_weights;                      ///< mask: sigmas by which its outlines are blurred; none: as drawn
    std::optional<double> blur_threshold;  ///< mask: at which they are cut then; absent: 0.5
    bool openings = true;                  ///< mask
    std::vector<std::string> materials;    ///< stack: one period, bottom up
    std::vector<double> thicknesses;       ///< stack: as many
    std::int64_t repeat = 1;               ///< stack: periods
    bool subtract = false;         ///< cut out of the layers below instead of added; it has no material then
    std::optional<double> z;       ///< sphere, cylinder, gap: of the centre; always set in a parsed recipe
    std::string axis = "y";        ///< cylinder
    std::optional<double> length;  ///< cylinder, gap; absent: through the domain
    std::optional<double> span;    ///< gap: along y; absent: through the domain
    std::string sweep = "extrusion";  ///< profile
    std::optional<double> base;       ///< mask: z of its underside; absent: down to what is below
    bool operator==(const Layer&) const = default;
};

/// One process step, or a loop over steps.
struct Step {
    std::string model;      ///< empty for a loop
    std::string name;       ///< what reports call it; empty: the model's name
    std::string chemistry;  ///< name of the deck that gave keys (decks.hpp), which is not stored
    double duration = 0.0;  ///< at most, if it has a stop condition (process/time_step.hpp)
    std::optional<double> stop_depth, stop_thickness;
    std::string stop_material;
    std::string
        stop;  ///< a figure and the value that ends the step, such as "depth > 2.0" or "bare(Si) > 0.9"
    double over_etch = 0.0, over_etch_time = 0.0;  ///< goes on after that: share of the time so far, time
    std::int64_t repeat = 1;
    std::any parameters;                       ///< the model's own struct, which its keys fill (ModelEntry)
    Layer pattern{.shape = "polygons"};        ///< of a step that has one: openings, seen from above
    std::vector<Step> steps;                   ///< what a loop repeats
    std::shared_ptr<const Model> built;        ///< the model of a parsed step that takes time
    bool operator==(const Step& other) const;  ///< whether all keys have the same values
};

struct FluxSection {
    std::string method = "auto";            ///< monte-carlo, radiosity, or auto
    double accuracy = 0.01;                 ///< share of what a step moves that noise may be off by
    std::int64_t rays = 0;                  ///< source rays a species and time step instead; 0: none given
    std::optional<double> relative_error;   ///< of every time step's fluxes, asked for instead
    std::int64_t max_rays = 1'000'000'000;  ///< that relative_error may spend
    std::int64_t batches = 32;              ///< independent parts; errors come from their scatter
    std::int64_t seed = 1;
    double memory = 2.0;  ///< GB, that radiosity's rays may take
    double reuse = 0.0;   ///< fluxes serve further time steps until they have changed by so much; 0: one
    double averaging =
        0.0;  ///< models see fluxes averaged over the surface within this distance; 0: as traced
    std::string stages = "step";  ///< when they are traced: at the start of a time step, or "all" its stages
    bool operator==(const FluxSection&) const = default;
    bool by_accuracy() const { return rays == 0 && !relative_error; }
    /// The most rays of a species and time step. Those for an accuracy are a million at 1 % or worse.
    std::int64_t most_rays() const {
        const double by_accuracy = 1e6 * std::max(1.0, std::pow(0.01 / accuracy, 2.0));
        if (relative_error) return max_rays;
        return rays != 0 ? rays
                         : static_cast<std::int64_t>(std::min(static_cast<double>(max_rays), by_accuracy));
    }
};

/// Lengths in the recipe's unit; absent is "auto", the grid spacing or a multiple of it
/// (simplify/simplify_options.hpp).
struct SimplifySection {
    std::string method = "auto";  ///< region-bounded where it pays (process/arriving/traced_mesh.hpp)
    std::optional<double> l0, step, l_max;
    std::optional<double> feature_parameter = 0.5;  ///< absent: from the curvature's distribution
    std::vector<double> weights;                    ///< volume, boundary, shape; empty: the method's own
    std::int64_t target_vertices = 0;               ///< 0: none
    std::optional<double> max_error;                ///< hard bound; not for CGAL's method
    double flux_change = 0.1;                       ///< along an edge, of itself; region-bounded only; 0: any
    bool operator==(const SimplifySection&) const = default;
};

struct OutputSection {
    std::optional<double> every;  ///< process time between saved surfaces; absent: the end of every step
    std::vector<std::string> profiles;
    bool operator==(const OutputSection&) const = default;
};

struct MetrologySection {
    std::vector<std::string> measures{"depth"};
    std::vector<double> cd_depths;  ///< below z = 0
    double mask_bottom = 0.0;       ///< z, for the undercut
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
    std::vector<Layer> layers;  ///< none of a run that starts from another
    std::vector<Step> steps;
    FluxSection flux;
    SimplifySection simplify;
    levelset::AdvectionOptions advection;
    OutputSection output;
    MetrologySection metrology;
    std::vector<std::string> notes;  ///< of the reader, e.g. on keys under former names
    bool operator==(const Recipe&) const = default;
};

/// Reads and validates a recipe.
///
/// \param text       TOML, whose sections and keys `sidewall models` lists.
/// \param file       its name, for messages; mesh files are sought beside it.
/// \param overrides  `key=value` settings such as `step[0].duration=2`, applied in order before validation.
///                   The value is TOML; bare words are strings.
/// \throws RecipeError naming file and line (or the override), key, value, the rule and what to do.
Recipe parse_recipe(std::string_view text, const std::string& file,
                    const std::vector<std::string>& overrides = {});

/// Reads and validates the recipe in a file.
/// \throws FileError if it cannot be read, RecipeError as parse_recipe.
Recipe load_recipe(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// Reads the domain, materials and metrology of a recipe's file; layers and steps are left out, whose files may be gone.
/// \throws FileError, RecipeError as load_recipe.
Recipe load_frame(const std::filesystem::path& path);

/// The simulation domain of a recipe, its spacing rounded to divide both extents.
levelset::Domain domain_of(const Recipe& recipe);

/// The steps in the order they run, loops unrolled, each with repeat 1 and a name such as "2.1 etch (cycle 3 of
/// 10)".
std::vector<Step> expanded_steps(const Recipe& recipe);

/// Whether anything but its duration can end a step.
bool has_stop(const Step& step);

/// The sum of the durations of unrolled steps.
double total_duration(const std::vector<Step>& steps);

/// The cuts of [output] profiles.
std::vector<surface::Plane> profile_planes(const Recipe& recipe);

}  // namespace sidewall::app
