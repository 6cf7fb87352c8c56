#include "app/recipe/layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/common/interrupt.hpp"
#include "app/recipe/layout/layout.hpp"
#include "app/recipe/profile_csv.hpp"
#include "app/schema/units.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// The first ten names, for a message.
std::string first_of(const auto& names) {
    std::string list;
    for (int count = 0; const std::string& name : names) {
        if (count == 10) return list + ", ...";
        list += (count++ > 0 ? ", " : "") + surface::printable(name);
    }
    return list;
}

// The blur of a mask's outlines; no value if they are used as drawn.
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
    levelset::Shape shape;
    shape.kind = kinds.at(layer.shape);
    shape.top = layer.top.value_or(0.0);
    shape.position = layer.position;
    shape.width = layer.width;
    shape.radius = layer.radius;
    shape.depth = layer.depth.value_or(kInfinity);
    shape.height = layer.height;
    shape.size = layer.size;
    shape.taper_deg = layer.taper_deg;
    shape.file = layer.file;
    shape.openings = layer.openings;
    shape.subtract = layer.subtract;
    shape.base = layer.base.value_or(-kInfinity);
    shape.centre_z = layer.z.value_or(0.0);
    shape.length = layer.length.value_or(kInfinity);
    if (layer.shape == "gap") shape.width = layer.span.value_or(kInfinity);
    shape.axis = layer.axis[0] - 'x';
    shape.revolved = layer.sweep == "revolution";
    if (layer.shape == "profile") shape.profile = read_profile(layer.file, recipe.domain.length_unit).points;
    if (has_outlines(layer)) outline(layer, recipe, shape);
    return shape;
}

const std::string kLengthKind = "length", kDegree = "degree";
const Rule kThroughOrAbove0 = or_word("through", kPositive);

Key position_key(Layer& layer, const char* doc) {
    return {"position", std::span<double>(layer.position), kLengthKind, doc, {}};
}

std::vector<Key> outline_keys(Outline& outline) {
    return {{"points", &outline.points, kLengthKind,
             "x and y of the first corner, of the second, and so on around the outline", required()}};
}

void add_polygons(Layer& layer, std::vector<Key>& list) {
    list.push_back({"polygons", table_list(layer.polygons, outline_keys), "",
                    "outlines seen from above, which must not cross or lie in one another; or give a file"});
    list.push_back(
        {"file", &layer.file, "",
         "layout file with the outlines, instead of polygons: GDSII or OASIS, plain or in gzip, relative "
         "to the recipe; outlines that overlap are united"});
    list.push_back({"cell", &layer.cell, "", "cell of the layout file; default: its only top cell"});
    list.push_back(
        {"gds_layer", &layer.gds_layer, "", "layer number in the layout file", within(0.0, 65535.0)});
    list.push_back({"gds_datatype", &layer.gds_datatype, "", "datatype number in the layout file",
                    within(0.0, 65535.0)});
    list.push_back(
        {"blur", &layer.blur, kLengthKind,
         "standard deviations of the Gaussians that blur the outlines, as lithography rounds corners and "
         "joins neighbours; what prints is above blur_threshold. Less than a fifth of grid_spacing has "
         "hardly any effect",
         kPositive});
    list.push_back({"blur_weights", &layer.blur_weights, "",
                    "weights of the Gaussians of blur, scaled to a sum of 1; default: equal", kPositive});
    list.push_back({"blur_threshold", &layer.blur_threshold, "",
                    "threshold above which blurred outlines print, as a share of the value inside a large "
                    "polygon, below 1; default 0.5",
                    positive_to(1.0)});
}

void add_mask(Layer& layer, std::vector<Key>& list) {
    add_polygons(layer, list);
    list.push_back({"openings", &layer.openings, "",
                    "true: the polygons are openings in the layer; false: the layer is there only in the "
                    "polygons"});
    list.push_back({"base", &layer.base, kLengthKind,
                    "z of the layer's underside; default: it stands on what is below"});
    list.push_back({"depth", &layer.depth, kLengthKind,
                    "with subtract, and required then: depth of the cut below the flat surface", kPositive});
    list.push_back(position_key(layer, "x and y of the polygons' origin"));
}

// Adds the keys of shapes with a centre: sphere, cylinder, gap.
void add_free(Layer& layer, std::vector<Key>& list) {
    list.push_back({"z",
                    &layer.z,
                    kLengthKind,
                    "z of the centre; default: that of the flat surface of the layers below",
                    {}});
    if (layer.shape == "gap") {
        list.push_back({"height", &layer.height, kLengthKind, "height along z", required(kPositive)});
        list.push_back({"length", &layer.length, kLengthKind, "length along x", kThroughOrAbove0});
        list.push_back({"width", &layer.span, kLengthKind, "width along y", kThroughOrAbove0});
    } else {
        list.push_back(
            {"radius", &layer.radius, kLengthKind, "radius of the sphere or cylinder", required(kPositive)});
    }
    if (layer.shape == "cylinder") {
        list.push_back(
            {"axis", &layer.axis, "", "direction of the cylinder's axis", one_of({"x", "y", "z"})});
        list.push_back({"length", &layer.length, kLengthKind,
                        "length along the axis; required if the axis is z", kThroughOrAbove0});
    }
    list.push_back(position_key(layer, "x and y of the centre"));
}

void add_profile(Layer& layer, std::vector<Key>& list) {
    list.push_back(
        {"file", &layer.file, "",
         "CSV file of points x, z, one a line, relative to the recipe: a curve with material below it, or "
         "a closed outline whose last point is the first. A unit in the heading is converted",
         required()});
    list.push_back(
        {"sweep", &layer.sweep, "",
         "extrusion: the profile is extended along y; revolution: it is turned about the vertical axis, x "
         "being the radius",
         one_of({"extrusion", "revolution"})});
    list.push_back(position_key(layer, "x and y at which the profile's x = 0 lies"));
}

void add_walls(Layer& layer, std::vector<Key>& list) {
    const std::string& shape = layer.shape;
    if (shape == "trench" || shape == "fin")
        list.push_back(
            {"width", &layer.width, kLengthKind, "width along x at the flat surface", required(kPositive)});
    if (shape == "hole")
        list.push_back(
            {"radius", &layer.radius, kLengthKind, "radius at the flat surface", required(kPositive)});
    if (shape == "box")
        list.push_back({"size", std::span<double>(layer.size), kLengthKind, "x and y lengths at the foot",
                        required(kPositive)});
    if (shape == "trench" || shape == "hole") {
        Rule rule = kThroughOrAbove0;
        if (layer.subtract) rule = required(kPositive);
        list.push_back({"depth", &layer.depth, kLengthKind,
                        "depth below the flat surface; required in the first layer", rule});
    } else {
        list.push_back(
            {"height", &layer.height, kLengthKind, "height above the flat surface", required(kPositive)});
    }
    list.push_back(position_key(layer, "x and y of the centre"));
    list.push_back(
        {"taper_deg", &layer.taper_deg, kDegree,
         "angle of the walls from the vertical; positive narrows a trench or hole downwards, a fin or box "
         "upwards",
         within(-80.0, 80.0)});
    if (shape == "box")
        list.push_back({"radius", &layer.radius, kLengthKind,
                        "radius of the rounded edges, all but those of the foot; 0 = sharp", kNotNegative});
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

bool has_outlines(const Layer& layer) {
    return layer.shape == "mask" || layer.shape == "polygons";
}

void find_file(Layer& layer, const std::filesystem::path& folder) {
    if (layer.shape != "mesh" && layer.shape != "profile" && !(has_outlines(layer) && !layer.file.empty()))
        return;
    layer.file = std::filesystem::absolute(folder / layer.file).lexically_normal().string();
    if (!std::filesystem::is_regular_file(layer.file))
        raise_key("file", "no such file: {}; the name is relative to the recipe", layer.file);
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
        raise_key("gds_layer", "the cell has no polygon on layer {}, datatype {}", layer.gds_layer,
                  layer.gds_datatype);
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
        throw KeyError("blur_weights", "weight the Gaussians of blur: give blur, too, or drop these");
    if (!blur && layer.blur_threshold)
        throw KeyError("blur_threshold", "applies to blurred outlines: give blur, too, or drop it");
    if (!blur) return placed;
    if (!blur->weights.empty() && blur->weights.size() != blur->sigmas.size())
        raise_key("blur_weights", "must be as many as the numbers of blur, {}", blur->sigmas.size());
    if (blur->threshold >= 1.0)
        throw KeyError("blur_threshold", "must be less than 1, the value inside a large polygon");
    const double longest = std::max(domain.max[0] - domain.min[0], domain.max[1] - domain.min[1]);
    for (std::size_t k = 0; k < blur->sigmas.size(); ++k)
        if (blur->sigmas[k] > longest)
            raise_key(fmt::format("blur[{}]", k), "is longer than the domain, {:g}; check the unit", longest);
    levelset::ResistContours printed;
    try {
        printed = levelset::resist_contours(placed, *blur, domain, interrupted);
    } catch (const GeometryError& error) {
        raise_key("blur", "{}; use a larger grid_spacing, or sigmas nearer to it and to one another",
                  error.what());
    }
    const double threshold = blur->threshold;
    if (printed.most <= threshold)
        raise_key("blur",
                  "nothing prints: the blurred outlines reach {:.3g} at most, below the threshold "
                  "of {:g}; use less blur, or a lower blur_threshold",
                  printed.most, threshold);
    if (printed.least > threshold)
        raise_key("blur",
                  "everything prints: blurred, the outlines leave {:.3g} at least, above the "
                  "threshold of {:g}; use less blur, or a higher blur_threshold",
                  printed.least, threshold);
    if (!printed.lost.empty()) {
        const levelset::Polygon& first = placed[printed.lost.front()];
        notes.push_back(fmt::format(
            "{}.blur: {} of {} outlines are too narrow to print and vanish, the first near ({:g}, {:g})",
            path, printed.lost.size(), placed.size(), first[0][0], first[0][1]));
    }
    return printed.outlines;
}

const std::vector<std::string>& shape_names() {
    static const std::vector<std::string> names = {"plane", "trench", "hole",   "fin",      "box", "stack",
                                                   "mesh",  "mask",   "sphere", "cylinder", "gap", "profile"};
    return names;
}

std::vector<Key> keys_of(Layer& layer) {
    const std::string& shape = layer.shape;
    std::vector<Key> list = {{"shape", &layer.shape, "", "", one_of(shape_names())}};
    const auto add = [&](Key key) { list.push_back(std::move(key)); };
    if (shape == "stack") {
        add({"materials", &layer.materials, "", "materials of one period, from the bottom up",
             required(kMaterial)});
        add({"thicknesses", &layer.thicknesses, kLengthKind, "thickness of each of the materials",
             required(kPositive)});
        add({"repeat", &layer.repeat, "", "number of periods", within(1, 10'000)});
        return list;
    }
    if (shape != "plane")
        add({"subtract", &layer.subtract, "",
             "true: the shape is cut out of all layers below, instead of added, and has no material"});
    add({"material", &layer.material, "", "what the layer is made of",
         layer.subtract ? kMaterial : required(kMaterial)});
    if (shape == "mesh") {
        add({"file", &layer.file, "",
             "closed or open surface, VTP, PLY, STL or OBJ, in the recipe's length unit", required()});
        return list;
    }
    if (shape == "sphere" || shape == "cylinder" || shape == "gap") {
        add_free(layer, list);
        return list;
    }
    add({"top", &layer.top, kLengthKind, "z of the flat surface; default 0 for the first layer", {}});
    if (!layer.subtract && shape != "profile")
        add({"thickness", &layer.thickness, kLengthKind, "instead of top: thickness above the layer below",
             kNotNegative});
    if (shape == "mask")
        add_mask(layer, list);
    else if (shape == "profile")
        add_profile(layer, list);
    else if (shape != "plane")
        add_walls(layer, list);
    return list;
}

std::vector<Key> pattern_keys(Layer& pattern) {
    const std::string shape = pattern.shape;
    const auto is = [&](const char* word) { return shape.empty() || shape == word; };
    std::vector<Key> list = {{"shape", &pattern.shape, "", "shape of the openings; default: polygons",
                              one_of({"polygons", "trench", "hole", "box"})}};
    if (is("polygons")) add_polygons(pattern, list);
    if (is("trench"))
        list.push_back({"width", &pattern.width, kLengthKind, "trench: width along x", required(kPositive)});
    if (is("hole"))
        list.push_back({"radius", &pattern.radius, kLengthKind, "hole: radius", required(kPositive)});
    if (is("box"))
        list.push_back({"size", std::span<double>(pattern.size), kLengthKind, "box: x and y lengths",
                        required(kPositive)});
    list.push_back({"openings", &pattern.openings, "",
                    "true: the shape or the polygons are open; false: everything else is open"});
    list.push_back(position_key(pattern, "x and y of the shape's centre, or of the polygons' origin"));
    return list;
}

}  // namespace sidewall::app
