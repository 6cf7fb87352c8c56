#include "app/process/estimate/memory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "app/common/free_memory.hpp"
#include "app/process/arriving/radiosity_fluxes.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/recipe_domain.hpp"

namespace sidewall::app {
namespace {

// Area of the walls that a shape adds to the flat wafer.
double wall_area(const levelset::Shape& shape, const levelset::Domain& domain) {
    const double depth = std::isfinite(shape.depth) ? shape.depth : 0.0;
    const double length = domain.max[1] - domain.min[1], width = domain.max[0] - domain.min[0];
    const double around = 2.0 * std::numbers::pi * shape.radius;
    switch (shape.kind) {
        case levelset::ShapeKind::trench:
            return 2.0 * depth * length;
        case levelset::ShapeKind::hole:
            return 2.0 * std::numbers::pi * shape.radius * depth;
        case levelset::ShapeKind::fin:
            return 2.0 * shape.height * length;
        case levelset::ShapeKind::box:
            return 2.0 * shape.height * (shape.size[0] + shape.size[1]);
        case levelset::ShapeKind::sphere:
            return 2.0 * shape.radius * around;
        case levelset::ShapeKind::cylinder:
            return around * (shape.radius + std::min(shape.length, shape.axis == 0 ? width : length));
        case levelset::ShapeKind::gap: {
            const double x = std::min(shape.length, width), y = std::min(shape.width, length);
            return 2.0 * (x * y + shape.height * (x + y));
        }
        case levelset::ShapeKind::profile: {
            double area = 0.0;
            for (std::size_t k = 0; k + 1 < shape.profile.size(); ++k) {
                const auto &a = shape.profile[k], &b = shape.profile[k + 1];
                area += std::hypot(b[0] - a[0], b[1] - a[1]) *
                        (shape.revolved ? std::numbers::pi * (a[0] + b[0]) : length);
            }
            return area;
        }
        default:
            return 0.0;
    }
}

// The smallest spacing, at least \p least, that the recipe can use, as text.
std::string spacing_from(double least, const Recipe& recipe, int levels) {
    if (levels > 1)
        if (std::string fits = spacing_for(levels, recipe.domain, least, least); !fits.empty()) return fits;
    const double digit = std::pow(10.0, std::floor(std::log10(least)) - 2.0);  // unit of the third digit
    return fmt::format("{:.10g}", digit * std::ceil(least / digit * (1.0 - 1e-9)));
}

}  // namespace

double estimated_memory(const Recipe& recipe, const levelset::Domain& domain) {
    const double flat = (domain.max[0] - domain.min[0]) * (domain.max[1] - domain.min[1]);
    double walls = 0.0, layers = 1.0;
    bool known = true;  // whether all walls have a known area
    for (const MaterialLayer& layer : expanded_layers(recipe)) {
        walls += wall_area(layer.shape, domain);
        layers += 1.0;
        known = known && layer.shape.kind != levelset::ShapeKind::mask &&
                layer.shape.kind != levelset::ShapeKind::mesh;
    }
    const double area = flat + walls;
    // With several levels, the finest usually covers the walls and as much again on either side of them.
    const int levels = grid_levels(recipe, domain);
    const double counted =
        known && levels > 1 ? std::min(area, 3.0 * walls + std::ldexp(flat, 2 - 2 * levels)) : area;
    // Bytes of a cell of surface. kPerLayer: about 14 voxels (4 bytes a layer; twice as much for buffers and
    // samples). kPerCell: two triangles with their hierarchy, attributes and tallies.
    constexpr double kPerLayer = 60.0, kPerCell = 1200.0;
    double cell = kPerCell + kPerLayer * layers;
    if (recipe.flux.stages != "step") cell *= 2.0;  // a second surface, within the time step
    if (recipe.flux.averaging > 0.0) {
        constexpr double kPerSample = 170.0;
        const double parts = std::ceil(2.0 * std::numbers::sqrt2 * domain.spacing / recipe.flux.averaging);
        cell += 2.0 * parts * parts * kPerSample;  // for two triangles
    }
    // After another run or a geometric step the finest level covers everything until columns are chosen.
    return (counted * cell + (area - counted) * kPerLayer * layers) / (domain.spacing * domain.spacing);
}

void require_memory(const Recipe& recipe, const levelset::Domain& domain, std::uint32_t processes) {
    const double needed = estimated_memory(recipe, domain);
    FreeMemory available = free_memory();
    if (processes > 1) {
        available.bytes /= processes;
        available.limit = fmt::format("for each of {} ranks {}", processes, available.limit);
    }
    const double rays = radiosity_memory(recipe.flux);
    if (needed + rays <= available.bytes) return;
    if (needed <= available.bytes)
        throw RecipeError(
            "{}: flux.memory = {:g}: besides {:.3g} GB for the surface the rays of "
            "radiosity may take {:.3g} GB, and {:.3g} GB are {}; lower it{}",
            recipe.file, recipe.flux.memory, needed / 1e9, rays / 1e9, available.bytes / 1e9, available.limit,
            recipe.flux.relative_error ? "" : ", or flux.rays");
    throw RecipeError(
        "{}: domain.grid_spacing = {:.4g}: the run would need about {:.3g} GB and {:.3g} GB are "
        "{}; use a spacing of {} or more",
        recipe.file, domain.spacing, needed / 1e9, available.bytes / 1e9, available.limit,
        spacing_from(domain.spacing * std::sqrt(needed / std::max(available.bytes, 1e6)), recipe,
                     grid_levels(recipe, domain)));
}

}  // namespace sidewall::app
