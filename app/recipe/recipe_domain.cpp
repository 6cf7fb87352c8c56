#include "app/recipe/recipe_domain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/models/model.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/layers.hpp"
#include "levelset/layers/levels.hpp"

namespace sidewall::app {
namespace {

// Whether all polygons are rectangles along the axes that extend beyond kFarAlongY grid spacings along y.
bool runs_along_y(const Layer& layer, double spacing) {
    const double far = kFarAlongY * spacing * (1.0 - 1e-9);
    return layer.file.empty() &&
           std::all_of(layer.polygons.begin(), layer.polygons.end(), [&](const Outline& outline) {
               const std::vector<double>& p = outline.points;
               return p.size() == 8 && p[0] == p[6] && p[2] == p[4] && p[1] == p[3] && p[5] == p[7] &&
                      p[1] <= -far && p[5] >= far;
           });
}

// Whether a recipe with this spacing can have so many levels.
bool divides_by(int levels, const DomainSection& domain, const std::string& spacing) {
    try {
        return levelset::most_levels(
                   levelset::make_domain(domain.extent, std::stod(spacing), domain.boundary)) >= levels;
    } catch (const RecipeError&) {
        return false;
    }
}

}  // namespace

bool is_flat(const DomainSection& domain) {
    return domain.extent[1] == 0.0 || domain.strip == Strip::profile;
}

bool is_axial(const DomainSection& domain) {
    return domain.symmetry == Symmetry::axial;
}

bool is_plane_profile(const DomainSection& domain) {
    return is_flat(domain) && !is_axial(domain);
}

void check_symmetry(const DomainSection& domain) {
    if (!is_axial(domain)) return;
    if (domain.extent[1] != 0.0)
        throw KeyError(
            "extent",
            "symmetry = \"axial\" asks for one number, the radius: for a square array of holes 0.564 times their "
            "pitch, for a hexagonal one 0.525 times");
    if (std::ranges::count(domain.boundary, levelset::Side::periodic) > 0)
        throw KeyError(
            "boundary",
            "a round wafer ends at a mirror: drop this, or symmetry = \"axial\" and give extent two numbers");
}

bool is_same_along_y(const Recipe& recipe) {
    const double spacing = recipe.domain.grid_spacing;
    const auto has_no_end = [&](const Layer& layer) {
        try {
            refuse_ends_along_y(layer, spacing);
        } catch (const KeyError&) {
            return false;
        }
        return true;
    };
    return std::ranges::all_of(recipe.layers, has_no_end) &&
           std::ranges::all_of(expanded_steps(recipe), [&](const Step& step) {
               if (step.built && step.built->depends_on_position) return false;
               return !find_model(step.model)->patterned || has_no_end(step.pattern);
           });
}

bool runs_as_profile(const Recipe& recipe) {
    constexpr double kMostCells = 8.5;  // along y, by the grid_spacing before rounding
    const DomainSection& domain = recipe.domain;
    if (domain.strip != Strip::automatic) return domain.strip == Strip::profile;
    if (is_flat(domain) || domain.extent[1] > domain.extent[0] ||
        domain.extent[1] > kMostCells * domain.grid_spacing)
        return false;
    if (recipe.grid.levels && *recipe.grid.levels > 1.0) return false;
    const auto along_y = [](const std::string& plane) {
        return surface::parse_plane(plane).normal.y() == 0.0;
    };
    const auto stops_by_roughness = [](const Step& step) { return is_roughness(step.stop); };
    if (along_y(recipe.metrology.cut) || std::ranges::any_of(recipe.output.profiles, along_y) ||
        std::ranges::any_of(recipe.metrology.measures, is_roughness) ||
        std::ranges::any_of(expanded_steps(recipe), stops_by_roughness) || !is_same_along_y(recipe))
        return false;
    if (recipe.start.from.empty()) return true;
    const auto before = std::filesystem::path(recipe.start.from) / "recipe.toml";
    return std::filesystem::exists(before) && load_frame(before).domain.strip == Strip::profile;
}

double volume_divisor(const Recipe& recipe) {
    if (!is_plane_profile(recipe.domain)) return 1.0;
    const double cell = domain_of(recipe).spacing, width = recipe.domain.extent[1];
    return width > 0.0 ? cell / width : cell;
}

std::string volume_unit(const Recipe& recipe) {
    return recipe.domain.length_unit +
           (recipe.domain.extent[1] == 0.0 && !is_axial(recipe.domain) ? "^2" : "^3");
}

void widen_to_strip(const Recipe& recipe, TriangleMesh& mesh) {
    if (recipe.domain.strip != Strip::profile) return;
    const double cells = recipe.domain.extent[1] / domain_of(recipe).spacing;
    for (Vec3& vertex : mesh.vertices) vertex.y() *= cells;
}

void refuse_ends_along_y(const Layer& layer, double spacing) {
    const auto refuse = [&](const char* key, const std::string& what, const char* instead) {
        raise_key(key,
                  "{}, but the wafer runs as a profile, the same at all y: {}, or give domain.extent two "
                  "numbers and no strip = \"profile\"",
                  what, instead);
    };
    const std::string& shape = layer.shape;
    if (shape == "hole") refuse("shape", "a hole is round", "use a trench");
    if (shape == "box") refuse("shape", "a box ends along y", layer.subtract ? "use a trench" : "use a fin");
    if (shape == "sphere") refuse("shape", "a sphere is round", "use a cylinder along y");
    if ((shape == "mask" || shape == "polygons") && !layer.blur.empty())
        refuse("blur", "blurred outlines end along y", "drop it");
    if ((shape == "mask" || shape == "polygons") && !runs_along_y(layer, spacing))
        refuse("shape", layer.file.empty() ? "polygons end along y" : "the outlines of a layout end along y",
               "use a trench");
    if (shape == "mesh") refuse("shape", "a mesh file need not be the same along y", "use a profile");
    if (shape == "cylinder" && layer.axis != "y")
        refuse("axis", fmt::format("the cylinder lies along {}", layer.axis), "use \"y\"");
    if (shape == "cylinder" && layer.length) refuse("length", "the cylinder ends along y", "drop the length");
    if (shape == "gap" && layer.span) refuse("width", "the gap ends along y", "drop the width");
    if (shape == "profile" && layer.sweep == "revolution")
        refuse("sweep", "what is turned about an axis is round", "use \"extrusion\"");
}

void refuse_off_axis(const Layer& layer) {
    const auto refuse = [&](const char* key, const std::string& what, const char* instead) {
        raise_key(key,
                  "{}, but domain.symmetry is \"axial\": {}, or drop symmetry and give "
                  "domain.extent two numbers",
                  what, instead);
    };
    const std::string& shape = layer.shape;
    const bool ring = shape == "trench" || shape == "fin" || (shape == "cylinder" && layer.axis == "y") ||
                      shape == "gap" || (shape == "profile" && layer.sweep != "revolution");
    if (shape == "box")
        refuse("shape", "a box has corners", "use a fin, which is a ring or a disk, or a cylinder");
    if (shape == "mask" || shape == "polygons")
        refuse("shape", "outlines have corners", "use a hole, or a trench, which is a ring");
    if (shape == "mesh") refuse("shape", "a mesh file need not be round", "use a profile");
    if (shape == "cylinder" && layer.axis == "x") refuse("axis", "the cylinder lies along x", "use \"z\"");
    if (shape == "cylinder" && layer.axis == "y" && layer.length)
        refuse("length", "the cylinder is a ring along y", "drop the length");
    if (shape == "gap" && layer.span) refuse("width", "the gap is a ring", "drop the width");
    if (layer.position[1] != 0.0) refuse("position", "the shape lies beside y = 0", "give its y as 0");
    const double x = layer.position[0], half = shape == "cylinder" ? layer.radius
                                               : shape == "gap"    ? 0.5 * layer.length.value_or(0.0)
                                                                   : 0.5 * layer.width;
    if (ring && shape != "profile" && (x < 0.0 || (x > 0.0 && x < half)))
        refuse("position", "the ring reaches over the axis", "give its x as 0, or as half its width or more");
    if (!ring && layer.position[0] != 0.0)
        refuse("position", "what is round lies beside the axis", "leave it at [0, 0], or use a ring");
}

std::string spacing_for(int levels, const DomainSection& domain, double wanted, double least) {
    constexpr int kLeastCells = 4;
    const int factor = 1 << (levels - 1);
    const double shorter = std::min(domain.extent[0], domain.extent[1]),
                 longer = std::max(domain.extent[0], domain.extent[1]);
    double nearest = kHuge;
    std::string best;
    const int most = std::max(static_cast<int>(std::lround(shorter / wanted)), 2 * kLeastCells);
    for (int n = kLeastCells; n <= most; ++n) {
        const double dx = shorter / (n * factor), along = longer / (dx * factor);
        if (dx < least || std::abs(along - std::round(along)) > 1e-6 * along) continue;
        const double away = std::abs(dx - wanted);
        if (away >= nearest) continue;
        const std::string text = fmt::format("{:.10g}", dx);
        if (!divides_by(levels, domain, text)) continue;
        nearest = away;
        best = text;
    }
    return best;
}

int grid_levels(const Recipe& recipe, const levelset::Domain& domain) {
    if (is_flat(recipe.domain)) return 1;
    if (recipe.grid.levels) return static_cast<int>(*recipe.grid.levels);
    // With fewer, the fine columns around features, about 64 finest cells with margins, would leave little
    // coarse.
    constexpr int kFewestCoarse = 24;
    int levels = levelset::most_levels(domain);
    while (levels > 1 && std::min(domain.cells[0], domain.cells[1]) >> (levels - 1) < kFewestCoarse) --levels;
    return levels;
}

void check_grid(const GridSection& grid, const DomainSection& domain) {
    if (!grid.levels) return;
    if (*grid.levels != std::floor(*grid.levels)) throw KeyError("levels", "must be 1, 2, 3 or \"auto\"");
    const int levels = static_cast<int>(*grid.levels);
    if (levels == 1) return;
    if (is_flat(domain))
        throw KeyError("levels", "must be 1 for a profile in x and z, which is one cell wide and as cheap");
    const levelset::Domain cells = levelset::make_domain(domain.extent, domain.grid_spacing, domain.boundary);
    const int most = levelset::most_levels(cells);
    if (levels <= most) return;
    const std::string spacing = spacing_for(levels, domain, cells.spacing);
    raise_key("levels",
              "joins {} cells into one along x and y, but {} x {} cells do not divide so, or fewer than 4 "
              "are left: {}use at most {} {}",
              1 << (levels - 1), cells.cells[0], cells.cells[1],
              spacing.empty() ? "" : fmt::format("a domain.grid_spacing of {} would do; else ", spacing),
              most, most == 1 ? "level" : "levels");
}

}  // namespace sidewall::app
