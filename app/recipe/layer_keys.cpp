#include "app/recipe/layer_keys.hpp"

namespace sidewall::app {
namespace {

const std::string kLengthKind = "length", kDegree = "degree";
const Rule kThroughOrAbove0 = or_word("through", kPositive);

Key position_key(Layer& layer, const char* doc) {
    return {"position", std::span<double>(layer.position), kLengthKind, doc, {}};
}

std::vector<Key> outline_keys(Outline& outline) {
    return {{"points", &outline.points, kLengthKind, "x and y of the corners in turn", required()}};
}

// What is drawn as outlines, listed or in a layout file.
void add_polygons(Layer& layer, std::vector<Key>& list) {
    list.push_back({"polygons", table_list(layer.polygons, outline_keys), "",
                    "outlines, which must not cross or lie in one another; or give a file"});
    list.push_back(
        {"file", &layer.file, "",
         "a layout, GDSII or OASIS, plain or in gzip, beside the recipe, instead of polygons; outlines that overlap are united"});
    list.push_back({"cell", &layer.cell, "", "of the file; default its only top cell"});
    list.push_back({"gds_layer", &layer.gds_layer, "", "of the file", within(0.0, 65535.0)});
    list.push_back({"gds_datatype", &layer.gds_datatype, "", "of the file", within(0.0, 65535.0)});
    list.push_back(
        {"blur", &layer.blur, kLengthKind,
         "standard deviations of Gaussians that blur the outlines before they are cut at blur_threshold: how "
         "neighbours and corners print; under a fifth of grid_spacing hardly seen",
         kPositive});
    list.push_back({"blur_weights", &layer.blur_weights, "",
                    "of blur's Gaussians; their sum counts as 1; default equal", kPositive});
    list.push_back({"blur_threshold", &layer.blur_threshold, "",
                    "of what lies under a large polygon, below 1: what is above prints; default 0.5",
                    positive_to(1.0)});
}

void add_mask(Layer& layer, std::vector<Key>& list) {
    add_polygons(layer, list);
    list.push_back({"openings", &layer.openings, "", "the polygons are open; else they are what stays"});
    list.push_back(
        {"base", &layer.base, kLengthKind, "z of its underside; default: it stands on what is below"});
    list.push_back({"depth", &layer.depth, kLengthKind,
                    "with subtract, and needed then: below the flat surface", kPositive});
    list.push_back(position_key(layer, "of the polygons' origin, x and y"));
}

// Shapes with a centre of their own.
void add_free(Layer& layer, std::vector<Key>& list) {
    list.push_back(
        {"z", &layer.z, kLengthKind, "of the centre; default that of the flat surface so far", {}});
    if (layer.shape == "gap") {
        list.push_back({"height", &layer.height, kLengthKind, "along z", required(kPositive)});
        list.push_back({"length", &layer.length, kLengthKind, "along x", kThroughOrAbove0});
        list.push_back({"width", &layer.span, kLengthKind, "along y", kThroughOrAbove0});
    } else {
        list.push_back(
            {"radius", &layer.radius, kLengthKind, "from the centre or axis", required(kPositive)});
    }
    if (layer.shape == "cylinder") {
        list.push_back({"axis", &layer.axis, "", "along which it lies", one_of({"x", "y", "z"})});
        list.push_back(
            {"length", &layer.length, kLengthKind, "along the axis; needed along z", kThroughOrAbove0});
    }
    list.push_back(position_key(layer, "centre, x and y"));
}

void add_profile(Layer& layer, std::vector<Key>& list) {
    list.push_back(
        {"file", &layer.file, "",
         "CSV of x and z, a point a line, a unit in the heading is converted: a curve with material below it, or a "
         "closed outline whose last point is the first",
         required()});
    list.push_back(
        {"sweep", &layer.sweep, "",
         "extrusion: drawn out along y; revolution: turned about the vertical axis, x its distance",
         one_of({"extrusion", "revolution"})});
    list.push_back(position_key(layer, "of x = 0, x and y"));
}

void add_walls(Layer& layer, std::vector<Key>& list) {
    const std::string& shape = layer.shape;
    if (shape == "trench" || shape == "fin")
        list.push_back(
            {"width", &layer.width, kLengthKind, "along x, at the flat surface", required(kPositive)});
    if (shape == "hole")
        list.push_back({"radius", &layer.radius, kLengthKind, "at the flat surface", required(kPositive)});
    if (shape == "box")
        list.push_back({"size", std::span<double>(layer.size), kLengthKind, "x and y lengths at the foot",
                        required(kPositive)});
    if (shape == "trench" || shape == "hole") {
        Rule rule = kThroughOrAbove0;
        if (layer.subtract) rule = required(kPositive);
        list.push_back({"depth", &layer.depth, kLengthKind,
                        "below the flat surface; required in the first layer", rule});
    } else {
        list.push_back({"height", &layer.height, kLengthKind, "above the flat surface", required(kPositive)});
    }
    list.push_back(position_key(layer, "centre, x and y"));
    list.push_back(
        {"taper_deg", &layer.taper_deg, kDegree,
         "walls from the vertical; positive narrows a trench or hole downwards, a fin or box upwards",
         within(-80.0, 80.0)});
    if (shape == "box")
        list.push_back({"radius", &layer.radius, kLengthKind, "of its edges but those of its foot; 0 = sharp",
                        kNotNegative});
}

}  // namespace

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
        add({"materials", &layer.materials, "", "one period, bottom up", required(kMaterial)});
        add({"thicknesses", &layer.thicknesses, kLengthKind, "of each of the materials",
             required(kPositive)});
        add({"repeat", &layer.repeat, "", "periods", within(1, 10'000)});
        return list;
    }
    if (shape != "plane")
        add({"subtract", &layer.subtract, "",
             "cut out of all layers below, instead of added; takes no material"});
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
        add({"thickness", &layer.thickness, kLengthKind, "instead of top: above the layer below",
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
    std::vector<Key> list = {{"shape", &pattern.shape, "", "what the openings are; default polygons",
                              one_of({"polygons", "trench", "hole", "box"})}};
    if (is("polygons")) add_polygons(pattern, list);
    if (is("trench"))
        list.push_back({"width", &pattern.width, kLengthKind, "trench: along x", required(kPositive)});
    if (is("hole")) list.push_back({"radius", &pattern.radius, kLengthKind, "hole", required(kPositive)});
    if (is("box"))
        list.push_back({"size", std::span<double>(pattern.size), kLengthKind, "box: x and y lengths",
                        required(kPositive)});
    list.push_back({"openings", &pattern.openings, "", "false: all but the shape or the polygons is open"});
    list.push_back(position_key(pattern, "centre of the shape, or of the polygons' origin, x and y"));
    return list;
}

}  // namespace sidewall::app
