#include "app/recipe/layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "app/common/interrupt.hpp"
#include "app/recipe/layout/flatten.hpp"
#include "app/recipe/layout/layout_file.hpp"
#include "app/recipe/profile_csv.hpp"
#include "app/schema/units.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Names for a message: ten at most.
std::string first_of(const auto& names) {
    std::string list;
    for (int count = 0; const std::string& name : names) {
        if (count == 10) return list + ", ...";
        list += (count++ > 0 ? ", " : "") + surface::printable(name);
    }
    return list;
}

// The blur of a mask's outlines; nothing if they are as drawn.
std::optional<levelset::Blur> blur_of(const Layer& layer) {
    if (layer.blur.empty()) return std::nullopt;
    return levelset::Blur{layer.blur, layer.blur_weights, layer.blur_threshold.value_or(0.5)};
}

// The outlines of a mask, as drawn or blurred by lithography.
void outline(const Layer& layer, const Recipe& recipe, levelset::Shape& shape) {
    shape.polygons = drawn_outlines(layer, recipe.domain.length_unit);
    const std::optional<levelset::Blur> blur = blur_of(layer);
    if (!blur) return;
    for (levelset::Polygon& polygon : shape.polygons) levelset::move_by(polygon, layer.position);
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
    if (layer.shape == "profile") shape.profile = read_profile(layer.file, recipe.domain.length_unit).points;
    if (drawn(layer)) outline(layer, recipe, shape);
    return shape;
}

}  // namespace

std::int64_t layer_count(const Layer& layer) {
    return layer.shape == "stack" ? layer.repeat * static_cast<std::int64_t>(layer.materials.size()) : 1;
}

std::size_t layer_count(const Recipe& recipe) {
    std::int64_t count = 0;
    for (const Layer& layer : recipe.layers) count += layer_count(layer);
    return static_cast<std::size_t>(count);
}

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

bool drawn(const Layer& layer) {
    return layer.shape == "mask" || layer.shape == "polygons";
}

void find_file(Layer& layer, const std::filesystem::path& folder) {
    if (layer.shape != "mesh" && layer.shape != "profile" && !(drawn(layer) && !layer.file.empty())) return;
    layer.file = std::filesystem::absolute(folder / layer.file).lexically_normal().string();
    if (!std::filesystem::is_regular_file(layer.file))
        throw KeyError("file",
                       fmt::format("no such file: {}; the name is relative to the recipe", layer.file));
}

std::vector<levelset::Polygon> drawn_outlines(const Layer& layer, const std::string& length_unit,
                                              std::string* note) {
    std::vector<levelset::Polygon> polygons;
    if (layer.file.empty() == layer.polygons.empty())
        throw KeyError("polygons", "give either polygons or the file of a layout, not both or neither");
    for (std::size_t k = 0; k < layer.polygons.size(); ++k) {
        const std::vector<double>& points = layer.polygons[k].points;
        if (points.size() < 6 || points.size() % 2 != 0)
            throw KeyError(fmt::format("polygons[{}].points", k),
                           "must be x and y of at least three corners");
        levelset::Polygon& polygon = polygons.emplace_back();
        for (std::size_t p = 0; p < points.size(); p += 2) polygon.push_back({points[p], points[p + 1]});
    }
    if (layer.file.empty()) return polygons;
    const Layout layout = read_layout(layer.file);
    const std::vector<std::string> tops = top_cells(layout);
    if (tops.empty() && !layout.cells.contains(layer.cell))
        throw KeyError("file", "has no top cell: its cells refer to each other in a circle, or it has none");
    if (layer.cell.empty() ? tops.size() != 1 : !layout.cells.contains(layer.cell))
        throw KeyError("cell", "must be one of the file's cells, whose top ones are: " + first_of(tops));
    std::set<std::string> missing;
    polygons = flatten(layout, layer.cell.empty() ? tops[0] : layer.cell, static_cast<int>(layer.gds_layer),
                       static_cast<int>(layer.gds_datatype), missing);
    if (note != nullptr && !missing.empty())
        *note =
            "the layout refers to cells that are not in the file, and is drawn without: " + first_of(missing);
    if (polygons.empty())
        throw KeyError("gds_layer", fmt::format("the cell has no polygon on layer {}, datatype {}",
                                                layer.gds_layer, layer.gds_datatype));
    for (levelset::Polygon& polygon : polygons)
        for (auto& point : polygon)
            for (double& x : point) x /= metres_in(length_unit);
    return polygons;
}

std::vector<levelset::Polygon> check_print(const Layer& layer, const std::vector<levelset::Polygon>& placed,
                                           const levelset::Domain& domain, const std::string& path,
                                           std::vector<std::string>& notes) {
    const std::optional<levelset::Blur> blur = blur_of(layer);
    if (!blur && !layer.blur_weights.empty())
        throw KeyError("blur_weights", "are of blur: give its sigmas, too, or drop these");
    if (!blur && layer.blur_threshold)
        throw KeyError("blur_threshold", "is of blur: give its sigmas, too, or drop it");
    if (!blur) return placed;
    if (!blur->weights.empty() && blur->weights.size() != blur->sigmas.size())
        throw KeyError("blur_weights",
                       fmt::format("must be as many as the sigmas of blur, {}", blur->sigmas.size()));
    if (blur->threshold >= 1.0)
        throw KeyError("blur_threshold", "must be less than 1, what lies under a large polygon");
    const double longest = std::max(domain.max[0] - domain.min[0], domain.max[1] - domain.min[1]);
    for (std::size_t k = 0; k < blur->sigmas.size(); ++k)
        if (blur->sigmas[k] > longest)
            throw KeyError(fmt::format("blur[{}]", k),
                           fmt::format("is longer than the domain, {:g}; check the unit", longest));
    levelset::ResistContours printed;
    try {
        printed = levelset::resist_contours(placed, *blur, domain, interrupted);
    } catch (const GeometryError& error) {
        throw KeyError("blur",
                       fmt::format("{}; use a larger grid_spacing, or sigmas nearer to it and to one another",
                                   error.what()));
    }
    const double threshold = blur->threshold;
    if (printed.most <= threshold)
        throw KeyError(
            "blur",
            fmt::format("nothing prints: the blurred outlines reach {:.3g} at most, below the threshold "
                        "of {:g}; use less blur, or a lower blur_threshold",
                        printed.most, threshold));
    if (printed.least > threshold)
        throw KeyError(
            "blur", fmt::format("everything prints: blurred, the outlines leave {:.3g} at least, above the "
                                "threshold of {:g}; use less blur, or a higher blur_threshold",
                                printed.least, threshold));
    if (!printed.lost.empty()) {
        const levelset::Polygon& first = placed[printed.lost.front()];
        notes.push_back(fmt::format(
            "{}.blur: {} of {} outlines are too narrow to print and vanish, the first near ({:g}, {:g})",
            path, printed.lost.size(), placed.size(), first[0][0], first[0][1]));
    }
    return printed.outlines;
}

}  // namespace sidewall::app
