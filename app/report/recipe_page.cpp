#include "app/report/recipe_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/models/model.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/steps.hpp"
#include "levelset/shapes/outline.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// The recipe on one grid level that is fine enough for a picture. Each layer costs a level set: stacks get
// fewer and thicker periods, and wafers of many layers fewer cells.
Recipe preview_of(const Recipe& recipe) {
    constexpr double kMostCells = 96.0, kMostFlatCells = 400.0, kFewestCells = 12.0, kManyLayers = 12.0;
    Recipe preview = recipe;
    for (Layer& layer : preview.layers) {
        if (layer.shape != "stack") continue;
        const auto most =
            static_cast<std::int64_t>(kManyLayers / static_cast<double>(layer.materials.size()));
        const std::int64_t drawn = std::clamp(most, std::int64_t{1}, layer.repeat);
        for (double& thickness : layer.thicknesses)
            thickness *= static_cast<double>(layer.repeat) / static_cast<double>(drawn);
        layer.repeat = drawn;
    }
    const double extent = std::max(recipe.domain.extent[0], recipe.domain.extent[1]);
    const double share = std::min(1.0, kManyLayers / static_cast<double>(layer_count(preview)));
    const double cells =
        std::max(kFewestCells, share * (is_flat(recipe.domain) ? kMostFlatCells : kMostCells));
    preview.domain.grid_spacing = std::max(recipe.domain.grid_spacing, extent / cells);
    preview.grid.levels = 1.0;
    return preview;
}

// Outlines of a mask, box, trench or hole seen from above, with their copies on periodic axes.
std::vector<levelset::Polygon> outlines_of(const levelset::Shape& shape, const levelset::Domain& domain) {
    const auto rectangle = [](double x, double y) {
        return levelset::Polygon{{-x / 2, -y / 2}, {x / 2, -y / 2}, {x / 2, y / 2}, {-x / 2, y / 2}};
    };
    std::vector<levelset::Polygon> outlines;
    if (shape.kind == levelset::ShapeKind::mask) outlines = shape.polygons;
    if (shape.kind == levelset::ShapeKind::box) outlines = {rectangle(shape.size[0], shape.size[1])};
    if (shape.kind == levelset::ShapeKind::trench)
        outlines = {rectangle(shape.width, 3 * (domain.max[1] - domain.min[1]))};
    if (shape.kind == levelset::ShapeKind::hole) {
        constexpr int kCorners = 64;
        levelset::Polygon& circle = outlines.emplace_back();
        for (int k = 0; k < kCorners; ++k) {
            const double angle = 2 * std::numbers::pi * k / kCorners;
            circle.push_back({shape.radius * std::cos(angle), shape.radius * std::sin(angle)});
        }
    }
    for (levelset::Polygon& outline : outlines) levelset::move_by(outline, shape.position);
    return levelset::repeated(outlines, domain);
}

// Outlines of masks in layers and steps, as [[[x, y], ...], ...], up to kMostCorners corners in all.
Json mask_outlines(const Recipe& recipe) {
    constexpr std::size_t kMostCorners = 20'000;
    std::vector<levelset::Shape> masks;
    for (const MaterialLayer& layer : expanded_layers(recipe))
        if (layer.shape.kind == levelset::ShapeKind::mask ||
            (layer.shape.kind == levelset::ShapeKind::hole && !layer.shape.subtract))
            masks.push_back(layer.shape);
    each_step(recipe.steps, [&](const Step& step, const std::string&) {
        const ModelEntry* model = find_model(step.model);
        if (model != nullptr && model->patterned) masks.push_back(pattern_of(step, recipe));
    });
    Json outlines = Json::array();
    std::size_t corners = 0;
    for (const levelset::Shape& mask : masks)
        for (const levelset::Polygon& outline : outlines_of(mask, domain_of(recipe))) {
            if ((corners += outline.size()) > kMostCorners) return outlines;
            Json& points = outlines.emplace_back(Json::array());
            for (const auto& [x, y] : outline)
                points.push_back(Json::array({number_or_null(x, 6), number_or_null(y, 6)}));
        }
    return outlines;
}

std::string text_or_none(const fs::path& file) {
    try {
        return surface::read_whole_file(file);
    } catch (const FileError&) {
        return "";
    }
}

// Most columns for keys and for figures in a table of runs; the first by name are kept.
constexpr std::size_t kMostKeys = 12, kMostFigures = 60;

template <class Map>
void keep_first(Map& map, std::size_t most) {
    while (map.size() > most) map.erase(std::prev(map.end()));
}

// Figures of a run's summary or, without one, of the last row of its timeline.
void add_figures(const std::string& summary, const fs::path& timeline, RunRow& row) {
    if (!summary.empty()) {
        constexpr std::size_t kMostValues = 50'000;
        const Json json = parse_json(summary, kMostValues);
        const Json units = json.value("metrology_units", Json::object());
        const Json metrology = json.value("metrology", Json::object());
        for (const auto& [name, value] : metrology.items()) row.figures[name] = {value, text_at(units, name)};
    } else if (is_there(timeline)) {
        const TextTable table = last_of_timeline(timeline);
        const std::size_t first = table.column("relative_error").value_or(table.names.size()) + 1;
        for (std::size_t k = first; k < table.names.size() && !table.rows.empty(); ++k) {
            const auto [name, unit] = name_and_unit(table.names[k]);
            row.figures[name] = {field_json(table.rows.back()[k]), unit};
        }
    }
}

}  // namespace

Page recipe_page(const Recipe& recipe, std::size_t bytes) {
    Page page{.kind = "recipe", .title = fs::path(recipe.file).stem().string(), .notes{}};
    const Recipe preview = preview_of(recipe);
    const levelset::Domain own = domain_of(recipe), shown = domain_of(preview);
    const auto wafer =
        std::make_shared<const Result>(wafer_result(preview, initial_state(preview).stack, 0.0));
    std::vector<surface::Plane> planes = profile_planes(recipe);
    if (planes.empty()) planes.push_back(surface::parse_plane(recipe.metrology.cut));
    planes.resize(1);
    View view = make_view({ViewFrame{"at the start", {}, {}, wafer}}, planes, bytes);
    page.surfaces = view.shown;
    const std::string unit = shown_unit(recipe.domain.length_unit);
    page.fact("Grid",
              fmt::format("{} × {} cells of {:.6g} {}", own.cells[0], own.cells[1], own.spacing, unit));
    std::string note = shown.spacing > own.spacing
                           ? fmt::format("Shown with a grid spacing of {:.3g} {}; the recipe's is {:.3g} {}.",
                                         shown.spacing, unit, own.spacing, unit)
                           : "Shown on the recipe's grid.";
    if (layer_count(preview) < layer_count(recipe))
        note += fmt::format(" Stacks are drawn with fewer, thicker layers: {} in all, of {}.",
                            layer_count(preview), layer_count(recipe));
    view.section["outlines"] = mask_outlines(recipe);
    if (!view.section["outlines"].empty()) note += " The lines above the wafer are masks.";
    view.section["note"] = note;
    view.section["title"] = "The wafer at the start";
    page.sections.push_back(std::move(view.section));
    return page;
}

std::map<std::string, std::string> written_keys(const std::string& effective) {
    std::map<std::string, std::string> keys;
    std::map<std::string, int> count;  // tables seen of each list, by its path
    std::string prefix;
    // Bytes; longer names are skipped, as `count` holds all prefixes of a name: memory grows as its square.
    constexpr std::size_t kLongest = 1000;
    for (const std::string& line : split(effective, '\n')) {
        if (std::min(line.find(" = "), line.size()) > kLongest) continue;
        if (line.starts_with("[[")) {
            prefix.clear();
            const std::vector<std::string> parts = split(line.substr(2, line.find("]]") - 2), '.');
            for (std::size_t k = 0; k < parts.size(); ++k) {
                prefix += parts[k];
                const int number = k + 1 < parts.size() ? count[prefix] - 1 : count[prefix]++;
                prefix += fmt::format("[{}].", number);
            }
        } else if (line.starts_with("[")) {
            prefix = line.substr(1, line.find(']') - 1) + ".";
        } else if (const auto equals = line.find(" = "); equals != std::string::npos && line[0] != '#') {
            keys[prefix + line.substr(0, equals)] =
                line.substr(equals + 3, line.rfind("  # ") - std::min(line.rfind("  # "), equals + 3));
        }
    }
    return keys;
}

RunRow run_row(const std::string& name, const std::string& recipe, const std::string& summary,
               const fs::path& timeline) {
    RunRow row{.name = name};
    try {
        row.keys = written_keys(recipe);
        add_figures(summary, timeline, row);
        keep_first(row.figures, kMostFigures + 1);  // one more, so that runs_table notices the rest
    } catch (const std::exception&) {               // files are damaged or of another program
    }
    return row;
}

Json runs_table(const std::vector<RunRow>& rows) {
    std::map<std::string, std::set<std::string>> values;  // values of each key in all runs
    std::map<std::string, std::string> measures;          // units of the figures
    std::set<std::string> all;
    for (const RunRow& row : rows) {
        for (const auto& [key, value] : row.keys) all.insert(key);
        for (const auto& [name, figure] : row.figures) measures.emplace(name, figure.second);
    }
    for (const std::string& key : all)
        for (const RunRow& row : rows)
            if (!row.keys.empty()) values[key].insert(row.keys.contains(key) ? row.keys.at(key) : "");
    Json table{{"type", "table"}, {"title", "Runs"}, {"columns", Json::array({Json{{"name", "run"}}})}};
    std::erase_if(values, [](const auto& key) { return key.second.size() < 2; });
    if (values.size() > kMostKeys || measures.size() > kMostFigures)
        table["note"] = fmt::format(
            "Only the first {} of the keys that differ and the first {} figures are shown, by name.",
            kMostKeys, kMostFigures);
    keep_first(values, kMostKeys);
    keep_first(measures, kMostFigures);
    for (const auto& [key, unused] : values) table["columns"].push_back(Json{{"name", key}});
    for (const auto& [name, unit] : measures)
        table["columns"].push_back(Json{{"name", name}, {"unit", shown_unit(unit)}});
    table["rows"] = Json::array();
    for (const RunRow& row : rows) {
        Json& fields = table["rows"].emplace_back(Json::array({row.name}));
        for (const auto& [key, unused] : values)
            fields.push_back(row.keys.contains(key) ? field_json(row.keys.at(key)) : Json());
        for (const auto& [name, unused] : measures)
            fields.push_back(row.figures.contains(name) ? row.figures.at(name).first : Json());
    }
    return table;
}

Page runs_page(const std::vector<fs::path>& folders, std::size_t bytes) {
    Page page{.kind = "runs", .title = fmt::format("{} runs", folders.size()), .notes{}};
    std::vector<ViewFrame> frames;
    std::vector<RunRow> rows;
    for (const fs::path& folder : folders) {
        const std::string name = folder.lexically_normal().string();
        if (auto frame = last_frame(folder, name))
            frames.push_back(*std::move(frame));
        else
            page.notes.push_back(name + " has saved no surface yet.");
        rows.push_back(run_row(name, text_or_none(folder / "recipe.toml"),
                               text_or_none(folder / "summary.json"), folder / "timeline.csv"));
    }
    page.sections.push_back(runs_table(rows));
    add_view(std::move(frames), folders.front() / "recipe.toml", bytes, "Last surfaces", "Last profiles",
             page);
    for (Json& section : page.sections)
        if (section["type"] == "charts")
            for (Json& chart : section["charts"]) chart["ramp"] = false;  // runs have no order
    return page;
}

}  // namespace sidewall::app
