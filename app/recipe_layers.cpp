#include "app/recipe_layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "app/recipe_reader.hpp"
#include "app/recipe_sections.hpp"

namespace sidewall::app {
namespace {

constexpr double kMostCells = 20'000;  // above or below z = 0
constexpr std::int64_t kMostLayers = 10'000;

// Fills in what a layer takes from those below it. \p top is the flat surface so far.
void place_layer(Layer& layer, bool first, double& top, const std::filesystem::path& folder) {
    if (layer.shape == "stack") {
        if (first) throw KeyError("shape", "a stack stands on a substrate: put a plane layer before it");
        if (layer.thicknesses.size() != layer.materials.size())
            throw KeyError("thicknesses",
                           fmt::format("must be as many as materials, {}", layer.materials.size()));
        double period = 0.0;
        for (const double thickness : layer.thicknesses) period += thickness;
        top += static_cast<double>(layer.repeat) * period;
        return;
    }
    if (layer.shape == "mesh") {
        layer.file = std::filesystem::absolute(folder / layer.file).lexically_normal().string();
        if (!std::filesystem::is_regular_file(layer.file))
            throw KeyError("file",
                           fmt::format("no such file: {}; the name is relative to the recipe", layer.file));
        return;
    }
    if (layer.top && layer.thickness) throw KeyError("thickness", "give top or thickness, not both");
    if (first && layer.thickness)
        throw KeyError("thickness", "the first layer has none below it; give top instead");
    const bool stands = layer.shape == "fin" || layer.shape == "box";
    if (!first && !stands && !layer.top && !layer.thickness)
        throw KeyError("thickness", "missing: give the layer's thickness, or its top");
    if (first && (layer.shape == "trench" || layer.shape == "hole") && !layer.depth)
        throw KeyError("depth", "missing: a trench or hole in the first layer must end somewhere");
    layer.top = layer.thickness ? top + *layer.thickness : layer.top.value_or(top);
    layer.thickness.reset();
    top = *layer.top;
}

// Heights beyond these are typing errors, and node indices must not overflow.
void check_height(const Layer& layer, double top, double spacing) {
    const auto check = [&](const char* key, double z) {
        if (std::abs(z) > kMostCells * spacing)
            throw KeyError(
                key, fmt::format("reaches {:.3g} cells from z = 0, over {:g}; check the unit or use a larger "
                                 "grid_spacing",
                                 std::abs(z) / spacing, kMostCells));
    };
    check(layer.shape == "stack" ? "thicknesses" : "top", top);
    check("depth", layer.depth.value_or(0.0));
    check("height", layer.height);
}

levelset::Shape shape_of(const Layer& layer) {
    static const std::map<std::string, levelset::ShapeKind, std::less<>> kinds = {
        {"plane", levelset::ShapeKind::plane}, {"trench", levelset::ShapeKind::trench},
        {"hole", levelset::ShapeKind::hole},   {"fin", levelset::ShapeKind::fin},
        {"box", levelset::ShapeKind::box},     {"mesh", levelset::ShapeKind::mesh}};
    levelset::Shape shape;
    shape.kind = kinds.at(layer.shape);
    shape.top = layer.top.value_or(0.0);
    shape.position = layer.position;
    shape.width = layer.width;
    shape.radius = layer.radius;
    shape.depth = layer.depth.value_or(std::numeric_limits<double>::infinity());
    shape.height = layer.height;
    shape.size = layer.size;
    shape.taper_deg = layer.taper_deg;
    shape.file = layer.file;
    return shape;
}

}  // namespace

void read_layers(const toml::table& root, Recipe& recipe) {
    const auto tables = tables_of(root, "layer", "layer");
    if (tables.empty()) fail_missing(root, "layer", "missing: a recipe needs a substrate: add a [[layer]]");
    const std::filesystem::path folder = std::filesystem::path(recipe.file).parent_path();
    double top = 0.0;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < tables.size(); ++i) {
        const std::string path = fmt::format("layer[{}]", i);
        Layer& layer = recipe.layers.emplace_back();
        if (const toml::node* shape = tables[i]->get("shape");
            shape != nullptr && shape->value_or<std::string>("") == "mask")
            fail(*shape, path + ".shape", "polygon masks are not available yet; use a hole, trench or box");
        read_field(*tables[i], path, fields(layer)[0],
                   recipe.materials);  // the shape decides which keys there are
        read_fields(*tables[i], path, "a " + layer.shape, fields(layer), recipe.materials);
        located(*tables[i], path, [&] {
            place_layer(layer, i == 0, top, folder);
            check_height(layer, top, recipe.domain.grid_spacing);
            count +=
                layer.shape == "stack" ? layer.repeat * static_cast<std::int64_t>(layer.materials.size()) : 1;
            if (count > kMostLayers)
                throw KeyError("repeat", fmt::format("makes more than {} layers", kMostLayers));
        });
    }
}

std::vector<MaterialLayer> expanded_layers(const Recipe& recipe) {
    std::vector<MaterialLayer> layers;
    double top = 0.0;
    for (const Layer& layer : recipe.layers) {
        if (layer.shape != "stack") {
            layers.push_back({*material_id(recipe.materials, layer.material), shape_of(layer)});
            top = layer.top.value_or(top);
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

}  // namespace sidewall::app
