#include "app/recipe/layout_extent.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "app/recipe/layer_keys.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/reader.hpp"
#include "app/recipe/sections.hpp"

namespace sidewall::app {
namespace {

constexpr double kExtentRounding = 1e-6;  // of a cell, by which a layout may exceed whole ones

// A mask of the recipe whose outlines are in a layout.
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

// A list of two numbers that names \p source as its place.
void write_pair(toml::table& table, const char* key, const std::array<double, 2>& pair,
                const std::string& source) {
    toml::table parsed =
        toml::parse(fmt::format("v = [{}, {}]", toml_text(pair[0]), toml_text(pair[1])), source);
    table.insert_or_assign(key, std::move(*parsed.get("v")->as_array()));
}

}  // namespace

void take_extent_from_layout(toml::table& root, Recipe& recipe) {
    toml::table* table = root["domain"].as_table();
    const toml::node* extent = table != nullptr ? table->get("extent") : nullptr;
    if (extent == nullptr || !extent->is_string()) return;
    if (extent->as_string()->get() != "gds")
        fail(*extent, "domain.extent", "must be one or two lengths, or \"gds\"");
    const Reading reading{recipe.materials, recipe.notes};
    DomainSection domain;
    if (!table->contains("grid_spacing"))
        fail_missing(*table, "domain.grid_spacing", "missing: the domain needs it");
    read_some(*table, "domain", keys_of(domain), {"grid_spacing", "length_unit", "padding"}, reading);

    std::vector<Placed> masks;
    collect(root, "layer", "layer", reading, masks);
    collect(root, "step", "step", reading, masks);
    if (masks.empty())
        fail(*extent, "domain.extent",
             "needs a layer or a step whose mask is a GDSII file; or give two lengths");
    Eigen::AlignedBox2d box;
    for (Placed& mask : masks) {
        const auto outlines = located(*mask.table, mask.path, [&] {
            try {
                find_file(mask.layer, std::filesystem::path(recipe.file).parent_path());
                return drawn_outlines(mask.layer, domain.length_unit);
            } catch (const FileError& error) {  // names the layout
                throw FileError(fmt::format("{}: {}.file: {}", place_of(*mask.table->get("file")), mask.path,
                                            error.what()));
            }
        });
        for (const levelset::Polygon& outline : outlines)
            for (const auto& [x, y] : outline)
                box.extend(Eigen::Vector2d(x + mask.layer.position[0], y + mask.layer.position[1]));
    }
    std::array<double, 2> size{}, centre{};
    const double around = 2.0 * domain.padding.value_or(0.0), longer = box.sizes().maxCoeff() + around;
    // The extent in whole cells of so large a spacing is far more than the layout's, which advice must go by.
    if (std::ceil(longer / domain.grid_spacing - kExtentRounding) < kFewestAlong)
        fail(*table->get("grid_spacing"), "domain.grid_spacing",
             fmt::format(
                 "the layout with its padding is {:.4g} {} long: makes a grid of fewer than {} cells, which "
                 "holds no shape: use a spacing of {:.3g} or less",
                 longer, domain.length_unit, kFewestAlong, longer / (2.0 * kFewestAlong)));
    for (std::size_t a = 0; a < 2; ++a) {
        const auto i = static_cast<Eigen::Index>(a);
        const double cells = (box.sizes()[i] + around) / domain.grid_spacing;
        size[a] = std::max(1.0, std::ceil(cells - kExtentRounding)) * domain.grid_spacing;
        centre[a] = box.center()[i];
    }

    for (const Placed& mask : masks)
        write_pair(*mask.table, "position",
                   {mask.layer.position[0] - centre[0], mask.layer.position[1] - centre[1]},
                   place_of(*mask.table));
    write_pair(*table, "extent", size, place_of(*extent));
    table->erase("padding");
    recipe.notes.push_back(
        fmt::format("domain.extent = \"gds\" is {:g} x {:g} {}: the layout's ({:g}, {:g}) is at the "
                    "centre",
                    size[0], size[1], domain.length_unit, centre[0], centre[1]));
}

}  // namespace sidewall::app
