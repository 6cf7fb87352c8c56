#include "app/process/stop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/recipe/figure_names.hpp"
#include "app/recipe/flat.hpp"
#include "app/results/figure_values.hpp"
#include "levelset/layers/layer_depths.hpp"
#include "levelset/layers/levels.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/ray_scene.hpp"

namespace sidewall::app {
namespace {

// In grid spacings. A front this near to where it is to stop has arrived: re-distancing keeps its place no
// better.
constexpr double kNear = 1e-3;

double lowest(const TriangleMesh& surface) {
    double z = std::numeric_limits<double>::infinity();
    for (const Vec3& p : surface.vertices) z = std::min(z, p.z());
    return z;
}

// How much at least lies on a material; 0 where it is bare.
double cover(const levelset::MaterialStack& stack, const TriangleMesh& surface, int material) {
    std::vector<levelset::LayerDepths> depths;  // by level
    for (const levelset::MaterialStack* level = &stack; level != nullptr; level = level->coarser.get())
        depths.emplace_back(*level);
    std::vector<float> depth(stack.layers.size() - 1);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        const Vec3 centroid = triangle_centroid(surface, t);
        const levelset::MaterialStack& here_counts = levelset::level_at(stack, centroid);
        const auto coarser =
            static_cast<std::size_t>(levelset::level_count(stack) - levelset::level_count(here_counts));
        const double touching = levelset::thinnest_film(here_counts.domain);
        depths[coarser].at(here_counts.domain.to_index(centroid), depth);
        for (std::size_t k = 0; k < stack.layers.size(); ++k) {
            const double here = k < depth.size() ? static_cast<double>(depth[k]) : 0.0;
            if (stack.layers[k].material == material)
                least = std::min(least, here <= touching ? 0.0 : here - 0.5 * touching);
            if (here <= touching) break;  // this layer is bare, those above end here
        }
    }
    return least;
}

double thickest(const levelset::MaterialStack& stack, const TriangleMesh& surface) {
    if (stack.layers.size() < 2) return 0.0;
    const TriangleMesh below = levelset::extract_surface(stack, stack.layers.size() - 2);
    if (below.triangles.empty()) return 0.0;
    const surface::RayScene scene(below);
    double most = 0.0;
    for (const Vec3& p : surface.vertices) most = std::max(most, scene.closest_point(p, 1e30).distance);
    return most;
}

// How far the front may move at least before the figure is beyond the value.
double way_to(const StopRule& rule, const Recipe& recipe, const levelset::MaterialStack& stack,
              const TriangleMesh& surface) {
    const Measure now = measure_named(recipe, rule.figure, stack, surface);
    const double left = rule.above ? rule.value - now.value : now.value - rule.value;
    if (!std::isfinite(left)) return std::numeric_limits<double>::infinity();  // there is no such figure yet
    if (left <= 0.0) return 0.0;
    const std::string& length = recipe.domain.length_unit;
    if (now.unit == length) return rule.figure == "depth" ? left : 0.5 * left;
    if (now.unit == volume_unit(recipe)) return left * width_of_strip(recipe) / total_area(surface);
    return std::numeric_limits<double>::infinity();
}

}  // namespace

StopDistance distance_to_stop(const Recipe& recipe, const Step& step, const levelset::MaterialStack& stack,
                              const TriangleMesh& surface) {
    StopDistance nearest;
    const auto consider = [&](double left, const char* key) {
        if (left < nearest.left) nearest = {left, key};
    };
    if (step.stop_depth) consider(*step.stop_depth + lowest(surface), "stop_depth");
    if (step.stop_thickness) consider(*step.stop_thickness - thickest(stack, surface), "stop_thickness");
    if (!step.stop_material.empty())
        consider(cover(stack, surface, *material_id(recipe.materials, step.stop_material)), "stop_material");
    if (const std::string& stop = step.stop; !stop.empty())
        consider(way_to(stop_rule(recipe, stop), recipe, stack, surface), "stop");
    if (nearest.left <= kNear * stack.domain.spacing) nearest.left = 0.0;
    return nearest;
}

void note_stop(const Step& step, std::size_t number, double to_stop) {
    const std::string& name = step.name.empty() ? step.model : step.name;
    if (to_stop == 0.0)
        fmt::print(stderr, "step {} ({}): its stop condition holds before it begins: it does nothing\n",
                   number, name);
    else if (std::isinf(to_stop) && !step.stop_material.empty())
        fmt::print(stderr, "step {} ({}): there is no {} on the wafer for stop_material to meet\n", number,
                   name, step.stop_material);
}

void note_missing_figure(const Recipe& recipe, const Step& step, std::size_t number,
                         const levelset::MaterialStack& stack) {
    const std::string& stop = step.stop;
    if (stop.empty()) return;
    const std::string figure = stop_rule(recipe, stop).figure;
    if (std::isfinite(measure_named(recipe, figure, stack, levelset::extract_surface(stack)).value)) return;
    fmt::print(stderr,
               "step {} ({}): ended by its duration: it was to stop at {}, which the wafer does not have\n",
               number, step.name.empty() ? step.model : step.name, figure);
}

}  // namespace sidewall::app
