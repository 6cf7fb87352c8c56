#include "app/recipe/recipe.hpp"

#include <fmt/ranges.h>

#include "app/common/text.hpp"
#include "app/recipe/decks.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/layer_reader.hpp"
#include "app/recipe/layout_extent.hpp"
#include "app/recipe/node_path.hpp"
#include "app/recipe/reader.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/step_materials.hpp"
#include "app/recipe/steps.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// In grid spacings. A small radius needs dense samples on the triangles; a large one covers many of them.
constexpr double kLeastAveraging = 0.25, kMostAveraging = 8.0;
constexpr double kMostAlong = 20'000;      // cells along x or y; with more the surface alone is too large
constexpr double kMostSurfaces = 100'000;  // most that [output] every may save
constexpr std::uintmax_t kMostRecipeBytes = 1 << 24;

void refuse_unknown_sections(const toml::table& root) {
    static const std::vector<std::string> known = {"domain",    "grid",   "start",     "material",
                                                   "layer",     "step",   "flux",      "simplify",
                                                   "advection", "output", "metrology", "cut"};
    for (const auto& [key, node] : root)
        if (std::find(known.begin(), known.end(), key.str()) == known.end())
            fail(node, key.str(), "unknown section{} There are {}", did_you_mean(": ", key.str(), known, "."),
                 fmt::join(known, ", "));
}

Reading reading_for(Recipe& recipe) {
    return {recipe.materials, recipe.notes};
}

template <class Section, class Check>
void read_section(const toml::table& root, const std::string& name, Section& section, const Reading& reading,
                  Check&& check) {
    const toml::node* node = root.get(name);
    if (node == nullptr) return;
    if (!node->is_table()) fail(*node, name, "must be a table: write [{}]", name);
    const toml::table& table = *node->as_table();
    read_keys(table, name, "[" + name + "]", keys_of(section), reading);
    located(table, name, check);
}

void read_material_tables(const toml::table& root, Recipe& recipe) {
    Materials& materials = recipe.materials;
    std::vector<std::string> seen;
    const auto tables = tables_of(root, "material", "material");
    for (std::size_t i = 0; i < tables.size(); ++i) {
        const std::string path = fmt::format("material[{}]", i);
        const auto name = (*tables[i])["name"].value<std::string>().value_or("");
        const std::optional<int> id = material_id(materials, name);
        Material material = id ? materials[static_cast<std::size_t>(*id)] : Material();
        read_keys(*tables[i], path, "[[material]]", keys_of(material), reading_for(recipe));
        located(*tables[i], path, [&] {
            if (name == "default" || trimmed(name) != name)
                throw KeyError("name", "must be a name without blanks at its ends, other than default");
            if (std::find(seen.begin(), seen.end(), name) != seen.end())
                throw KeyError("name", "is defined twice; drop one [[material]]");
            const bool hex =
                material.colour.size() == 7 && material.colour[0] == '#' &&
                material.colour.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
            if (!hex) throw KeyError("colour", "must look like \"#8fa3b8\"");
        });
        seen.push_back(name);
        if (id)
            materials[static_cast<std::size_t>(*id)] = material;
        else
            materials.push_back(material);
    }
}

void read_domain(const toml::table& root, Recipe& recipe) {
    if (!root.contains("domain"))
        fail_missing(root, "domain", "missing: add [domain] with extent and grid_spacing");
    const DomainSection& domain = recipe.domain;
    read_section(root, "domain", recipe.domain, reading_for(recipe), [&] {
        if (domain.padding)
            throw KeyError("padding", "is for extent = \"gds\" or [cut]: drop it, or the numbers of extent");
        check_symmetry(domain);
        if (domain.strip == Strip::profile && domain.extent[1] == 0.0)
            throw KeyError("strip", "\"profile\" is for a wafer with two extents: drop it");
        for (const double extent : domain.extent)
            if (extent / domain.grid_spacing > kMostAlong)
                raise_key("grid_spacing",
                          "needs {:.3g} cells for an extent of {:g}, over {:g}; use a "
                          "larger spacing",
                          extent / domain.grid_spacing, extent, kMostAlong);
    });
    if (domain.extent[1] == 0.0 && !is_axial(domain)) recipe.domain.boundary[1] = levelset::Side::periodic;
    try {
        const levelset::Domain grid = domain_of(recipe);
        if (std::max(grid.cells[0], grid.cells[1]) < kFewestAlong)
            throw RecipeError(
                "domain.grid_spacing = {:g}: makes a grid of {} x {} cells, which holds no shape: use "
                "a spacing of {:.3g} or less",
                domain.grid_spacing, grid.cells[0], grid.cells[1],
                std::max(domain.extent[0], domain.extent[1]) / (2.0 * kFewestAlong));
    } catch (const RecipeError& error) {  // names the key itself
        throw RecipeError("{}: {}", place_of(*root["domain"]["grid_spacing"].node()), error.what());
    }
}

// Absolute path of an earlier run's folder, searched in the recipe's folder \p beside and the current one.
std::string run_folder(const std::string& name, const std::filesystem::path& beside) {
    for (const std::filesystem::path& base : {beside, std::filesystem::current_path()}) {
        std::filesystem::path folder = std::filesystem::absolute(base / name).lexically_normal();
        if (!folder.has_filename()) folder = folder.parent_path();
        std::error_code failure;
        if (std::filesystem::exists(folder / "checkpoint.vdb", failure)) return folder.string();
    }
    throw KeyError("from",
                   "no run to start from: name a folder with the checkpoint.vdb of a run, relative to the "
                   "recipe or to where the program runs");
}

void read_start(const toml::table& root, Recipe& recipe) {
    StartSection& start = recipe.start;
    read_section(root, "start", start, reading_for(recipe), [&] {
        if (start.time && start.step > 0) throw KeyError("step", "give time or step, not both");
        start.from = run_folder(start.from, std::filesystem::path(recipe.file).parent_path());
    });
}

void check_simplify(const SimplifySection& simplify) {
    if (simplify.l0 && simplify.l_max && *simplify.l_max < *simplify.l0)
        raise_key("l_max", "must be at least l0 = {:g}", *simplify.l0);
    if (!simplify.weights.empty() && simplify.weights[0] + simplify.weights[1] + simplify.weights[2] <= 0.0)
        throw KeyError("weights", "must not all be 0");
    if (simplify.max_error && simplify.method == "cgal-lindstrom-turk")
        throw KeyError("max_error", "is not kept by method = \"cgal-lindstrom-turk\": use another method");
}

void check_averaging(double radius, const DomainSection& domain) {
    const double least = kLeastAveraging * domain.grid_spacing, most = kMostAveraging * domain.grid_spacing;
    if (radius != 0.0 && (radius < least || radius > most))
        raise_key("averaging", "must be 0, or {:g} to {:g} grid spacings, {:g} to {:g}", kLeastAveraging,
                  kMostAveraging, least, most);
    // Beyond a side the surface is continued by one copy only, so the radius may not exceed the domain.
    const double width = is_flat(domain) ? domain.extent[0] : std::min(domain.extent[0], domain.extent[1]);
    if (radius > width) raise_key("averaging", "must not exceed the wafer's {:g}", width);
}

// Reads a plane and checks that it meets the wafer: a cut that misses it would silently give an empty file.
surface::Plane vertical_plane(const std::string& text, const Recipe& recipe, const std::string& key) {
    surface::Plane plane;
    try {
        plane = surface::parse_plane(text);
    } catch (const RecipeError&) {
        throw KeyError(key, "must be a plane such as \"y=0\" or \"x=-1.5\"");
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const bool across = plane.normal[static_cast<int>(axis)] != 0.0;
        const double half = 0.5 * recipe.domain.extent[axis];
        if (across && axis == 0 && is_flat(recipe.domain))
            throw KeyError(key,
                           "lies along y, where a profile in x and z is the same everywhere; use \"y=0\"");
        if (across && std::abs(plane.offset) > half)
            raise_key(key, "lies outside the domain, which ends at +-{:g}", half);
    }
    return plane;
}

void read_metrology(const toml::table& root, Recipe& recipe) {
    read_section(root, "metrology", recipe.metrology, reading_for(recipe), [&] {
        const MetrologySection& metrology = recipe.metrology;
        if (vertical_plane(metrology.cut, recipe, "cut").normal.z() != 0.0)
            throw KeyError("cut", "must be vertical, such as \"y=0\"");
        for (std::size_t i = 0; i < metrology.measures.size(); ++i)
            require_measure(recipe, metrology.measures[i], fmt::format("measures[{}]", i));
        const bool cd = std::count(metrology.measures.begin(), metrology.measures.end(), "cd") > 0;
        if (cd && metrology.cd_depths.empty())
            throw KeyError("cd_depths", "missing: cd is measured at depths, e.g. cd_depths = [0.5, 1.0]");
    });
}

// Checks that all materials on the wafer have values in each step; one error lists all that lack some.
void require_all_values(const toml::table& root, const Recipe& recipe) {
    std::string missing;
    for (const StepMaterials& here : materials_by_step(recipe)) {
        try {
            located(*find_node(root, here.path)->as_table(), here.path,
                    [&] { require_values(here, recipe.materials); });
        } catch (const RecipeError& error) {
            missing += (missing.empty() ? "" : "\n") + std::string(error.what());
        }
    }
    if (!missing.empty()) throw RecipeError(missing);
}

// Refuses a stop figure that never exists in this step: of an absent material, or of an endless thickness.
void require_figure(const Recipe& recipe, const Step& step, const StopRule& rule,
                    const std::vector<StepMaterials>& met) {
    const std::string& name = rule.figure;
    const auto figure = named_figure(name, recipe.materials);
    const int id = figure ? figure->material : rule.bare;
    if (id < 0 || !recipe.start.from.empty()) return;
    const std::string& material = recipe.materials[static_cast<std::size_t>(id)].name;
    const auto here =
        std::find_if(met.begin(), met.end(), [&](const StepMaterials& entry) { return entry.step == &step; });
    const auto meshes = std::any_of(recipe.layers.begin(), recipe.layers.end(),
                                    [](const Layer& layer) { return layer.shape == "mesh"; });
    if (here != met.end() && std::count(here->ids.begin(), here->ids.end(), id) == 0)
        raise_key("stop",
                  "there is no {} on the wafer in this step, and {} never exists; name "
                  "another material",
                  material, name);
    if (figure && figure->kind == FigureKind::thickness && !meshes &&
        recipe.layers.front().material == material)
        raise_key("stop",
                  "the substrate of {} has no end below, and {} never exists; use depth, or "
                  "a substrate of another material below",
                  material, name);
}

// Checks the stop conditions of the steps. \pre [metrology] is read.
void check_stops(const toml::table& root, const Recipe& recipe) {
    const std::vector<StepMaterials> met = materials_by_step(recipe);
    each_step(recipe.steps, [&](const Step& step, const std::string& here) {
        if (!has_stop(step) && step.over_etch == 0.0 && step.over_etch_time == 0.0) return;
        located(*find_node(root, here)->as_table(), here, [&] {
            if (!has_stop(step))
                throw KeyError(step.over_etch > 0.0 ? "over_etch" : "over_etch_time",
                               "goes on after an endpoint, which this step lacks: add stop, such as "
                               "\"bare(Si) > 0.9\"");
            if (step.over_etch > 0.0 && step.over_etch_time > 0.0)
                throw KeyError("over_etch_time", "over_etch sets the length of the over-etch, too: drop one");
            if (step.stop.empty()) return;
            const StopRule rule = stop_rule(recipe, step.stop);
            if (rule.bare >= 0 && !step.stop_material.empty())
                throw KeyError("stop",
                               "stop_material ends the step at a bare share, too: drop stop_material");
            require_figure(recipe, step, rule, met);
        });
    });
}

std::string text_of(const std::filesystem::path& path) {
    std::error_code failure;
    const std::string name = path.string();
    if (!std::filesystem::exists(path, failure))
        throw FileError("{}: no such file: give a recipe, e.g. configs/trench_deposition.toml", name);
    if (!std::filesystem::is_regular_file(path, failure))
        throw FileError("{}: not a file: give a recipe in TOML", name);
    if (std::filesystem::file_size(path, failure) > kMostRecipeBytes)
        throw FileError("{}: larger than {} bytes: give a recipe in TOML", name, kMostRecipeBytes);
    return surface::read_whole_file(path);
}

void unroll(const std::vector<Step>& steps, const std::string& number, const std::string& cycles,
            std::vector<Step>& list) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const Step& step = steps[i];
        const std::string label =
            number.empty() ? fmt::format("{}", i + 1) : fmt::format("{}.{}", number, i + 1);
        for (std::int64_t cycle = 1; cycle <= step.repeat; ++cycle) {
            std::string here = cycles;
            if (step.repeat > 1)
                here += fmt::format("{}cycle {} of {}", cycles.empty() ? "" : ", ", cycle, step.repeat);
            if (!step.steps.empty()) {
                unroll(step.steps, label, here, list);
                continue;
            }
            Step flat = step;
            flat.repeat = 1;
            flat.name = fmt::format("{} {}", label, step.name.empty() ? step.model : step.name);
            if (!here.empty()) flat.name += " (" + here + ")";
            list.push_back(std::move(flat));
        }
    }
}

}  // namespace

bool Step::operator==(const Step& other) const {
    return name == other.name && steps == other.steps && differences(*this, other).empty();
}

Recipe parse_recipe(std::string_view text, const std::string& file,
                    const std::vector<std::string>& overrides) {
    Recipe recipe;
    recipe.file = file;
    toml::table root = recipe_tables(text, file, overrides, recipe.notes);
    refuse_unknown_sections(root);
    read_material_tables(root, recipe);
    take_cut_from_layout(root, recipe);
    take_extent_from_layout(root, recipe);
    read_domain(root, recipe);
    read_section(root, "grid", recipe.grid, reading_for(recipe),
                 [&] { check_grid(recipe.grid, recipe.domain); });
    read_start(root, recipe);
    read_layers(root, recipe);
    read_steps(root, recipe);
    require_all_values(root, recipe);
    const Reading reading = reading_for(recipe);
    read_section(root, "advection", recipe.advection, reading, [] {});
    read_section(root, "flux", recipe.flux, reading, [&] {
        if (recipe.flux.rays != 0 && recipe.flux.rays < 100)
            throw KeyError("rays", "must be in [100, 1e+12], or 0 for as many as accuracy asks for");
        if (recipe.flux.rays != 0 && !recipe.flux.relative_error && recipe.flux.batches > recipe.flux.rays)
            raise_key("batches", "must be at most rays = {}: every batch traces one at least",
                      recipe.flux.rays);
        check_averaging(recipe.flux.averaging, recipe.domain);
        if (recipe.flux.stages == "all" && levelset::stage_count(recipe.advection.time_integration) == 1)
            throw KeyError(
                "stages",
                "needs advection.time_integration = \"rk2\" or \"rk3\": \"euler\" has one stage only");
    });
    read_section(root, "simplify", recipe.simplify, reading, [&] { check_simplify(recipe.simplify); });
    if (is_flat(recipe.domain)) recipe.output.profiles = {"y=0"};
    read_section(root, "output", recipe.output, reading, [&] {
        const std::vector<std::string>& profiles = recipe.output.profiles;
        for (std::size_t i = 0; i < profiles.size(); ++i)
            vertical_plane(profiles[i], recipe, fmt::format("profiles[{}]", i));
        if (recipe.output.every &&
            total_duration(expanded_steps(recipe)) / *recipe.output.every > kMostSurfaces)
            raise_key("every", "saves more than {:g} surfaces; use a longer time", kMostSurfaces);
    });
    read_metrology(root, recipe);
    check_stops(root, recipe);
    if (runs_as_profile(recipe)) recipe.domain.strip = Strip::profile;
    return recipe;
}

Recipe load_recipe(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
    return parse_recipe(text_of(path), path.string(), overrides);
}

Recipe load_frame(const std::filesystem::path& path) {
    const toml::table root = parse_toml(text_of(path), path.string());
    Recipe recipe;
    recipe.file = path.string();
    read_material_tables(root, recipe);
    read_domain(root, recipe);
    read_metrology(root, recipe);
    return recipe;
}

levelset::Domain domain_of(const Recipe& recipe) {
    const DomainSection& domain = recipe.domain;
    std::array<double, 2> extent = domain.extent;
    std::array<levelset::Side, 2> sides = domain.boundary;
    if (is_flat(domain)) {
        extent[1] = extent[0] / std::max(1.0, std::round(extent[0] / domain.grid_spacing));
        if (!is_axial(domain)) sides[1] = levelset::Side::periodic;
    }
    levelset::Domain grid = levelset::make_domain(extent, domain.grid_spacing, sides);
    if (is_axial(domain)) {
        grid.side[1] = levelset::Side::periodic;
        grid.min[0] = 0.0, grid.max[0] = extent[0];
        grid.axial = true;
    }
    return grid;
}

std::vector<surface::Plane> profile_planes(const Recipe& recipe) {
    std::vector<surface::Plane> planes;
    for (const std::string& text : recipe.output.profiles) planes.push_back(surface::parse_plane(text));
    return planes;
}

std::vector<Step> expanded_steps(const Recipe& recipe) {
    std::vector<Step> list;
    unroll(recipe.steps, "", "", list);
    return list;
}

bool has_stop(const Step& step) {
    return step.stop_depth || step.stop_thickness || !step.stop_material.empty() || !step.stop.empty();
}

double total_duration(const std::vector<Step>& steps) {
    double total = 0.0;
    for (const Step& step : steps) total += step.duration;
    return total;
}

}  // namespace sidewall::app
