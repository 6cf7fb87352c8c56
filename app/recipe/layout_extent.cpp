#include "app/recipe/layout_extent.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "app/common/text.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/reader.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/sections.hpp"
#include "levelset/shapes/polygon_clipping.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr double kExtentRounding = 1e-6;  // in cells, by which a layout may exceed whole cells

constexpr double kWidestLine = 0.2500001;  // width over length; 0.25 and rounding

// A mask of the recipe with outlines in a layout.
struct Placed {
    toml::table* table = nullptr;
    std::string path;
    Layer layer;
};

void read_some(const toml::table& table, const std::string& path, const std::vector<Key>& keys,
               std::initializer_list<std::string_view> names, const Reading& reading) {
    for (const Key& key : keys)
        if (std::find(names.begin(), names.end(), key.name) != names.end())
            read_key(table, path, key, reading);
}

void collect(toml::table& parent, std::string_view key, const std::string& path, const Reading& reading,
             std::vector<Placed>& masks) {
    toml::array* array = parent[key].as_array();
    for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
        toml::table* table = array->get(i)->as_table();
        if (table == nullptr) continue;
        const std::string here = fmt::format("{}[{}]", path, i);
        if (table->contains("steps")) collect(*table, "steps", here + ".steps", reading, masks);
        const std::string model = (*table)["model"].value_or<std::string>(""),
                          shape = (*table)["shape"].value_or<std::string>("");
        const bool mask =
            model == "mask" || model == "cut" ? shape.empty() || shape == "polygons" : shape == "mask";
        if (!mask || !table->contains("file")) continue;
        Placed& placed = masks.emplace_back(Placed{table, here, {}});
        placed.layer.shape = "mask";
        read_some(*table, here, keys_of(placed.layer),
                  {"file", "cell", "gds_layer", "gds_datatype", "position"}, reading);
    }
}

// Layer and datatype in text such as "gds:63/0", after the \p prefix; no value for other text.
std::optional<std::array<std::int64_t, 2>> layer_in(std::string_view text, std::string_view prefix) {
    if (!text.starts_with(prefix)) return std::nullopt;
    text.remove_prefix(prefix.size());
    std::array<std::int64_t, 2> numbers{};
    const std::vector<std::string> parts = split(text, '/');
    if (parts.size() != 2) return std::nullopt;
    for (std::size_t k = 0; k < 2; ++k)
        if (!surface::read_number(parts[k], numbers[k]) || numbers[k] < 0 || numbers[k] > 65535)
            return std::nullopt;
    return numbers;
}

// All masks of a recipe with outlines in layouts; \p asking is the key that needs them.
std::vector<Placed> masks_in_layouts(toml::table& root, const Reading& reading, const toml::node& asking,
                                     std::string_view path) {
    std::vector<Placed> masks;
    collect(root, "layer", "layer", reading, masks);
    collect(root, "step", "step", reading, masks);
    if (masks.empty())
        fail(
            asking, path,
            "needs a layer or a step whose mask is a layout's file; or drop this and give two lengths as domain.extent");
    return masks;
}

// Outlines of a mask at its position, from its layer or from the \p other one, which \p asking names.
std::vector<levelset::Polygon> outlines_at(Placed& mask, const Recipe& recipe, const std::string& unit,
                                           const std::optional<std::array<std::int64_t, 2>>& other,
                                           const toml::node& asking, std::string_view path,
                                           std::string* note = nullptr) {
    std::vector<levelset::Polygon> outlines = located(*mask.table, mask.path, [&] {
        try {
            find_file(mask.layer, std::filesystem::path(recipe.file).parent_path());
            Layer layer = mask.layer;
            if (other) std::tie(layer.gds_layer, layer.gds_datatype) = std::tie((*other)[0], (*other)[1]);
            return drawn_outlines(layer, unit, note);
        } catch (const FileError& error) {  // the message names the layout
            throw FileError("{}: {}.file: {}", place_of(*mask.table->get("file")), mask.path, error.what());
        } catch (const KeyError& error) {
            if (other && error.key == "gds_layer") fail(asking, path, error.rule);
            throw;
        }
    });
    for (levelset::Polygon& outline : outlines) levelset::move_by(outline, mask.layer.position);
    return outlines;
}

// Reads the keys of [domain] that are needed to convert a layout's extent.
DomainSection domain_keys(const toml::table& table, const Reading& reading) {
    DomainSection domain;
    if (!table.contains("grid_spacing"))
        fail_missing(table, "domain.grid_spacing", "missing: the domain needs it");
    read_some(table, "domain", keys_of(domain), {"grid_spacing", "length_unit", "padding"}, reading);
    return domain;
}

double whole_cells(double length, double spacing) {
    return std::max(1.0, std::ceil(length / spacing - kExtentRounding)) * spacing;
}

// Writes a value whose place, in messages, is \p source.
void write_value(toml::table& table, const char* key, const std::string& text, const std::string& source) {
    toml::table parsed = toml::parse("v = " + text, source);
    table.insert_or_assign(key, std::move(*parsed.get("v")->as_array()));
}

// A line in a layout, drawn as a path of two points or a thin box; directed to the right, or upwards.
struct Line {
    Eigen::Vector2d from, to;
};

// The lines that the polygons represent: between the midpoints of the shorter pair of opposite edges.
std::vector<Line> lines_of(const std::vector<levelset::Polygon>& polygons) {
    std::vector<Line> lines;
    for (const levelset::Polygon& polygon : polygons) {
        const auto require = [&](bool is_line, const char* what) {
            if (!is_line)
                raise_key("layer",
                          "holds {} at ({:g}, {:g}): draw each line as a path of two points or a "
                          "box, at most a quarter as wide as it is long",
                          what, polygon[0][0], polygon[0][1]);
        };
        require(polygon.size() == 4, "a shape that is no straight line");
        std::array<Eigen::Vector2d, 4> p;
        for (std::size_t k = 0; k < 4; ++k) p[k] = {polygon[k][0], polygon[k][1]};
        const std::size_t k =
            (p[1] - p[0]).norm() + (p[3] - p[2]).norm() < (p[2] - p[1]).norm() + (p[0] - p[3]).norm() ? 0 : 1;
        Line line{0.5 * (p[k] + p[k + 1]), 0.5 * (p[k + 2] + p[(k + 3) % 4])};
        const Eigen::Vector2d along = line.to - line.from;
        const double width = std::max((p[k + 1] - p[k]).norm(), (p[(k + 3) % 4] - p[k + 2]).norm());
        require(width < kWidestLine * along.norm(),
                along.isZero() ? "a line without length" : "a box that is no line");
        const double tiny = kExtentRounding * along.norm();
        if (along.x() < -tiny || (along.x() <= tiny && along.y() < 0.0)) std::swap(line.from, line.to);
        lines.push_back(line);
    }
    return lines;
}

// Ends of the intervals in which the line through \p centre along the unit vector \p axis lies inside the
// outlines, as distances from \p centre.
std::vector<double> crossings(const std::vector<levelset::Polygon>& outlines, const Eigen::Vector2d& centre,
                              const Eigen::Vector2d& axis) {
    std::vector<double> at;
    for (const levelset::Polygon& outline : outlines)
        for (std::size_t k = 0, j = outline.size() - 1; k < outline.size(); j = k++) {
            const Eigen::Vector2d a = Eigen::Vector2d(outline[j][0], outline[j][1]) - centre,
                                  b = Eigen::Vector2d(outline[k][0], outline[k][1]) - centre;
            const double left = axis.x() * a.y() - axis.y() * a.x(),
                         right = axis.x() * b.y() - axis.y() * b.x();
            if ((left > 0.0) == (right > 0.0)) continue;
            at.push_back(axis.dot(a) + axis.dot(b - a) * left / (left - right));
        }
    std::sort(at.begin(), at.end());
    return at;
}

}  // namespace

void take_cut_from_layout(toml::table& root, Recipe& recipe) {
    const toml::node* node = root.get("cut");
    if (node == nullptr) return;
    const toml::table* cut = node->as_table();
    if (cut == nullptr) fail(*node, "cut", "must be a section: write [cut], and the layer of the line below");
    const Reading reading{recipe.materials, recipe.notes};
    CutSection section;
    read_keys(*cut, "cut", "a cut", keys_of(section), reading);
    const toml::node& asking = *cut->get("layer");
    const auto layer = layer_in(section.layer, "");
    if (!layer) fail(asking, "cut.layer", "must be a layer and a datatype, such as \"63/0\"");
    toml::table* table = root["domain"].as_table();
    if (table == nullptr) fail_missing(root, "domain", "missing: add [domain] with grid_spacing");
    if (const toml::node* extent = table->get("extent"))
        fail(*extent, "domain.extent", "is the length of the line that [cut] names: drop one of them");
    const DomainSection domain = domain_keys(*table, reading);
    std::vector<Placed> masks = masks_in_layouts(root, reading, asking, "cut.layer");
    const Line line = located(*cut, "cut", [&] {
        Placed unmoved = masks.front();
        unmoved.layer.position = {};
        const auto lines =
            lines_of(outlines_at(unmoved, recipe, domain.length_unit, layer, asking, "cut.layer"));
        const auto count = static_cast<std::int64_t>(lines.size());
        if (section.line > count || (section.line == 0 && count > 1))
            raise_key("line", "the layer holds {} lines: choose one, from 1 to {}", count, count);
        return lines[static_cast<std::size_t>(std::max<std::int64_t>(section.line, 1) - 1)];
    });
    const Eigen::Vector2d centre = 0.5 * (line.from + line.to), axis = (line.to - line.from).normalized();
    const double length = whole_cells((line.to - line.from).norm() + 2.0 * domain.padding.value_or(0.0),
                                      domain.grid_spacing),
                 far = kFarAlongY * domain.grid_spacing;
    for (Placed& mask : masks) {
        const toml::node& file = *mask.table->get("file");
        std::vector<double> ends;
        std::string note;
        try {
            ends = crossings(levelset::united(outlines_at(mask, recipe, domain.length_unit, std::nullopt,
                                                          asking, "", &note)),
                             centre, axis);
        } catch (const GeometryError& error) {
            fail(file, mask.path + ".file", error.what());
        }
        if (!note.empty()) recipe.notes.push_back(fmt::format("{}.file: {}", mask.path, note));
        std::string list;
        for (std::size_t k = 0; k + 1 < ends.size(); k += 2)
            if (ends[k] < 0.5 * length && ends[k + 1] > -0.5 * length)
                list +=
                    fmt::format("{{ points = [{0}, {2}, {1}, {2}, {1}, {3}, {0}, {3}] }}, ",
                                toml_text(ends[k]), toml_text(ends[k + 1]), toml_text(-far), toml_text(far));
        if (list.empty())
            fail(file, mask.path + ".file",
                 "its outlines do not meet the line of [cut]: the mask would be all open or all closed; drop "
                 "it, or choose another line");
        const std::string source = place_of(file);
        for (const char* key : {"file", "cell", "gds_layer", "gds_datatype", "position"})
            mask.table->erase(key);
        write_value(*mask.table, "polygons", "[" + list + "]", source);
    }
    write_value(*table, "extent", fmt::format("[{}]", toml_text(length)), place_of(asking));
    table->erase("padding");
    recipe.notes.push_back(fmt::format(
        "cut.layer: the profile of {:g} {} along the line from ({:g}, {:g}) to ({:g}, {:g}), whose middle is at "
        "x = 0",
        length, domain.length_unit, line.from.x(), line.from.y(), line.to.x(), line.to.y()));
    root.erase("cut");
}

void take_extent_from_layout(toml::table& root, Recipe& recipe) {
    toml::table* table = root["domain"].as_table();
    const toml::node* extent = table != nullptr ? table->get("extent") : nullptr;
    if (extent == nullptr || !extent->is_string()) return;
    const std::string text = extent->as_string()->get();
    const auto layer = layer_in(text, "gds:");
    if (text != "gds" && !layer)
        fail(*extent, "domain.extent",
             "must be one or two lengths, \"gds\", or a layer such as \"gds:63/0\"");
    const Reading reading{recipe.materials, recipe.notes};
    const DomainSection domain = domain_keys(*table, reading);
    std::vector<Placed> masks = masks_in_layouts(root, reading, *extent, "domain.extent");
    Eigen::AlignedBox2d box;
    for (Placed& mask : masks)
        for (const levelset::Polygon& outline :
             outlines_at(mask, recipe, domain.length_unit, layer, *extent, "domain.extent"))
            for (const auto& [x, y] : outline) box.extend(Eigen::Vector2d(x, y));
    std::array<double, 2> size{}, centre{};
    const double around = 2.0 * domain.padding.value_or(0.0), longer = box.sizes().maxCoeff() + around;
    // The advice is based on the layout's size: rounded to whole cells of so large a spacing it grows by far.
    if (std::ceil(longer / domain.grid_spacing - kExtentRounding) < kFewestAlong)
        fail(*table->get("grid_spacing"), "domain.grid_spacing",
             "the layout with its padding is {:.4g} {} long: makes a grid of fewer than {} cells, which "
             "holds no shape: use a spacing of {:.3g} or less",
             longer, domain.length_unit, kFewestAlong, longer / (2.0 * kFewestAlong));
    for (std::size_t a = 0; a < 2; ++a) {
        const auto i = static_cast<Eigen::Index>(a);
        size[a] = whole_cells(box.sizes()[i] + around, domain.grid_spacing);
        centre[a] = box.center()[i];
    }

    const auto pair = [](double x, double y) { return fmt::format("[{}, {}]", toml_text(x), toml_text(y)); };
    for (const Placed& mask : masks)
        write_value(*mask.table, "position",
                    pair(mask.layer.position[0] - centre[0], mask.layer.position[1] - centre[1]),
                    place_of(*mask.table));
    write_value(*table, "extent", pair(size[0], size[1]), place_of(*extent));
    table->erase("padding");
    recipe.notes.push_back(
        fmt::format("domain.extent = \"{}\" is {:g} x {:g} {}: the layout's ({:g}, {:g}) is at the "
                    "centre",
                    text, size[0], size[1], domain.length_unit, centre[0], centre[1]));
}

}  // namespace sidewall::app
