#include "app/recipe/layer_reader.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/recipe/layer_checks.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/polygon_checks.hpp"
#include "app/recipe/profile_csv.hpp"
#include "app/recipe/reader.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr std::int64_t kMostLayers = 10'000;

// Whether the layer is placed by its centre, not by the flat surface.
bool is_free(const Layer& layer) {
    return layer.shape == "sphere" || layer.shape == "cylinder" || layer.shape == "gap";
}

// Refuses a first layer that needs others below it.
void refuse_first(const Layer& layer) {
    if (layer.subtract)
        throw KeyError("subtract",
                       "nothing lies below the first layer to cut out of: put another layer before it");
    if (layer.shape == "mask" || is_free(layer))
        raise_key("shape", "a {} stands on a substrate: put another layer before it", layer.shape);
    if (layer.thickness) throw KeyError("thickness", "the first layer has none below it; give top instead");
    if ((layer.shape == "trench" || layer.shape == "hole") && !layer.depth)
        throw KeyError("depth", "missing: a trench or hole in the first layer must end somewhere");
}

// A mask that is cut out ends at a depth; one that is added ends at the layer below or at its base.
void check_ends(const Layer& layer) {
    if (layer.subtract && !layer.depth)
        throw KeyError("depth", "missing: a mask that is cut out must end somewhere below the flat surface");
    if (layer.subtract && layer.base)
        throw KeyError("base", "a mask that is cut out ends at depth: drop base");
    if (!layer.subtract && layer.depth)
        throw KeyError("depth", "is for a mask that is cut out: set subtract = true, or give base");
}

// Sets what follows from the layers below. \p top is the height of the flat surface so far.
void place_layer(Layer& layer, bool first, double& top, const std::filesystem::path& folder) {
    if (layer.shape == "stack") {
        if (first) throw KeyError("shape", "a stack stands on a substrate: put a plane layer before it");
        if (layer.thicknesses.size() != layer.materials.size())
            raise_key("thicknesses", "must be as many as materials, {}", layer.materials.size());
        double period = 0.0;
        for (const double thickness : layer.thicknesses) period += thickness;
        top += static_cast<double>(layer.repeat) * period;
        return;
    }
    find_file(layer, folder);
    if (layer.subtract && !layer.material.empty())
        throw KeyError("material", "a layer that is cut out has none: drop it, or subtract");
    if (layer.shape == "mesh" && !first) return;
    if (layer.top && layer.thickness) throw KeyError("thickness", "give top or thickness, not both");
    if (first) refuse_first(layer);
    if (layer.shape == "mesh") return;
    if (is_free(layer)) {
        layer.z = layer.z.value_or(top);
        if (layer.shape == "cylinder" && layer.axis == "z" && !layer.length)
            throw KeyError("length", "missing: a vertical cylinder must end somewhere");
        return;
    }
    if (layer.shape == "mask") check_ends(layer);
    const bool stands =
        layer.shape == "fin" || layer.shape == "box" || layer.shape == "profile" || layer.subtract;
    if (!first && !stands && !layer.top && !layer.thickness)
        throw KeyError("thickness", "missing: give the layer's thickness, or its top");
    layer.top = layer.thickness ? layer.base.value_or(top) + *layer.thickness : layer.top.value_or(top);
    layer.thickness.reset();
    if (layer.base && *layer.base >= *layer.top)
        raise_key("base", "must be below the mask's top, {:g}", *layer.top);
    if (!layer.subtract) top = *layer.top;
}

// Larger heights are typing errors, and would overflow node indices.
void check_height(const Layer& layer, double top, double spacing) {
    const auto check = [&](const char* key, double z) {
        if (std::abs(z) > kMostCells * spacing)
            raise_key(key,
                      "reaches {:.3g} cells from z = 0, over {:g}; check the unit or use a larger "
                      "grid_spacing",
                      std::abs(z) / spacing, kMostCells);
    };
    check(layer.shape == "stack" ? "thicknesses" : "top", layer.top.value_or(top));
    check("depth", layer.depth.value_or(0.0));
    check("height", layer.height);
    check("base", layer.base.value_or(0.0));
    if (!is_free(layer)) return;
    check("z", *layer.z);
    check("radius", layer.radius);
    if (layer.axis == "z") check("length", layer.length.value_or(0.0));
}

// Checks the layer's shape against the grid. Reads its file, so that `sidewall check` finds errors there.
// \param below  height of the flat surface under the layer, minus infinity for the first layer.
void check_layer(const Layer& layer, double below, const toml::table& table, const std::string& path,
                 Recipe& recipe) {
    const levelset::Domain domain = domain_of(recipe);
    if (domain.axial)
        refuse_off_axis(layer);
    else if (is_flat(recipe.domain))
        refuse_ends_along_y(layer, domain.spacing);
    try {
        if (layer.shape == "mesh")
            check_mesh(layer, domain, kMostCells * domain.spacing, path, recipe.notes);
        else if (layer.shape == "profile") {
            const ProfileTable profile = read_profile(layer.file, recipe.domain.length_unit);
            recipe.notes.push_back(fmt::format("{}.file: {}", path, profile.understood));
            check_profile(layer, profile.points, std::isinf(below), domain);
        } else if (has_outlines(layer)) {
            std::string note;
            const auto outlines = drawn_outlines(layer, recipe.domain.length_unit, &note);
            if (!note.empty()) recipe.notes.push_back(fmt::format("{}.file: {}", path, note));
            check_polygons(layer, outlines, domain, path, recipe.notes);
        } else if (layer.shape != "stack")
            check_shape(layer, layer.top && !layer.subtract ? *layer.top - below : kHuge, domain, path,
                        recipe.notes);
    } catch (const FileError& error) {  // the message names the file
        throw FileError("{}: {}.file: {}", place_of(*table.get("file")), path, error.what());
    }
}

}  // namespace

void read_layers(const toml::table& root, Recipe& recipe) {
    if (!recipe.start.from.empty()) {
        if (const toml::node* layers = root.get("layer"))
            fail(*layers, "layer", "a run that starts from another has its layers; drop these, or [start]");
        return;
    }
    const auto tables = tables_of(root, "layer", "layer");
    if (tables.empty()) fail_missing(root, "layer", "missing: a recipe needs a substrate: add a [[layer]]");
    const std::filesystem::path folder = std::filesystem::path(recipe.file).parent_path();
    double top = 0.0;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < tables.size(); ++i) {
        const std::string path = fmt::format("layer[{}]", i);
        Layer& layer = recipe.layers.emplace_back();
        const Reading reading{recipe.materials, recipe.notes};
        read_key(*tables[i], path, keys_of(layer)[0], reading);  // the shape decides which keys there are
        if (layer.shape != "plane" && layer.shape != "stack")
            read_key(*tables[i], path, keys_of(layer)[1], reading);  // so does whether the layer is cut out
        read_keys(*tables[i], path, "a " + layer.shape, keys_of(layer), reading);
        located(*tables[i], path, [&] {
            const double below = i == 0 ? -kInfinity : top;
            if (layer.thickness && !layer.base && i > 0 && recipe.layers.front().shape == "mesh")
                recipe.notes.push_back(fmt::format(
                    "{}.thickness counts from z = {:g}: a mesh has no flat surface; give top instead", path,
                    top));
            place_layer(layer, i == 0, top, folder);
            check_height(layer, top, recipe.domain.grid_spacing);
            count += layer_count(layer);
            if (count > kMostLayers) raise_key("repeat", "makes more than {} layers", kMostLayers);
            check_layer(layer, below, *tables[i], path, recipe);
        });
    }
}

void place_pattern(const toml::table& table, const std::string& path, Step& step, Recipe& recipe) {
    located(table, path, [&] {
        find_file(step.pattern, std::filesystem::path(recipe.file).parent_path());
        check_layer(step.pattern, 0.0, table, path, recipe);
    });
}

}  // namespace sidewall::app
