#include "app/recipe/layers.hpp"

#include <limits>
#include <map>

#include "app/common/interrupt.hpp"
#include "app/recipe/mask_outlines.hpp"
#include "app/recipe/profile_csv.hpp"

namespace sidewall::app {
namespace {

// The outlines of a mask, as drawn or blurred by lithography.
void outline(const Layer& layer, const Recipe& recipe, levelset::Shape& shape) {
    shape.polygons = drawn_outlines(layer, recipe.domain.length_unit);
    const std::optional<levelset::Blur> blur = blur_of(layer);
    if (!blur) return;
    for (levelset::Polygon& polygon : shape.polygons)
        for (auto& p : polygon)
            for (std::size_t a = 0; a < 2; ++a) p[a] += layer.position[a];
    shape.polygons =
        levelset::resist_contours(shape.polygons, *blur, domain_of(recipe), interrupted).outlines;
    shape.position = {};
    shape.contours = true;
}

levelset::Shape shape_of(const Layer& layer, const Recipe& recipe) {
    static const std::map<std::string, levelset::ShapeKind, std::less<>> kinds = {
        {"plane", levelset::ShapeKind::plane},   {"trench", levelset::ShapeKind::trench},
        {"hole", levelset::ShapeKind::hole},     {"fin", levelset::ShapeKind::fin},
        {"box", levelset::ShapeKind::box},       {"mesh", levelset::ShapeKind::mesh},
        {"mask", levelset::ShapeKind::mask},     {"polygons", levelset::ShapeKind::mask},
        {"sphere", levelset::ShapeKind::sphere}, {"cylinder", levelset::ShapeKind::cylinder},
        {"gap", levelset::ShapeKind::gap},       {"profile", levelset::ShapeKind::profile}};
    constexpr double kThrough = std::numeric_limits<double>::infinity();
    levelset::Shape shape;
    shape.kind = kinds.at(layer.shape);
    shape.top = layer.top.value_or(0.0);
    shape.position = layer.position;
    shape.width = layer.width;
    shape.radius = layer.radius;
    shape.depth = layer.depth.value_or(kThrough);
    shape.height = layer.height;
    shape.size = layer.size;
    shape.taper_deg = layer.taper_deg;
    shape.file = layer.file;
    shape.openings = layer.openings;
    shape.subtract = layer.subtract;
    shape.base = layer.base.value_or(-kThrough);
    shape.centre_z = layer.z.value_or(0.0);
    shape.length = layer.length.value_or(kThrough);
    if (layer.shape == "gap") shape.width = layer.span.value_or(kThrough);
    shape.axis = layer.axis[0] - 'x';
    shape.revolved = layer.sweep == "revolution";
    if (layer.shape == "profile") shape.profile = read_profile(layer.file);
    if (drawn(layer)) outline(layer, recipe, shape);
    return shape;
}

}  // namespace

std::vector<MaterialLayer> expanded_layers(const Recipe& recipe) {
    std::vector<MaterialLayer> layers;
    double top = 0.0;
    for (const Layer& layer : recipe.layers) {
        if (layer.shape != "stack") {
            layers.push_back(
                {material_id(recipe.materials, layer.material).value_or(-1), shape_of(layer, recipe)});
            if (!layer.subtract) top = layer.top.value_or(top);
            continue;
        }
        for (std::int64_t period = 0; period < layer.repeat; ++period) {
            for (std::size_t m = 0; m < layer.materials.size(); ++m) {
                top += layer.thicknesses[m];
                levelset::Shape plane;
                plane.top = top;
                layers.push_back({*material_id(recipe.materials, layer.materials[m]), plane});
            }
        }
    }
    return layers;
}

levelset::Shape pattern_of(const Step& step, const Recipe& recipe) {
    return shape_of(step.pattern, recipe);
}

}  // namespace sidewall::app
