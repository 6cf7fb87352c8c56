#include "app/recipe/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/models/model.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/steps.hpp"
#include "app/schema/units.hpp"

namespace sidewall::app {
namespace {

const std::string kLength = "length", kTime = "time";

// With fewer rays the flux error exceeds a third even on the smallest grid.
constexpr double kFewestRays = 100.0;
// Shorter time steps only add rounding: the front would take a thousand of them to cross a cell.
constexpr double kLeastCfl = 1e-3;

const Rule kLengthOrAuto = or_word("auto", kNotNegative);
const Rule kAboveZeroOrAuto = or_word("auto", kPositive);

template <class Section>
SectionDoc section(std::string name, std::string header, std::string doc, Section defaults = {}) {
    return {std::move(name), std::move(header), std::move(doc), document(keys_of(defaults))};
}

// Documents the key that selects the section with its own word in place of all words.
SectionDoc chosen(SectionDoc doc, const std::string& key, const std::string& word) {
    for (KeyDoc& row : doc.keys)
        if (row.name == key) row.type = toml_text(word);
    return doc;
}

void add(std::vector<KeyDoc>& keys, const std::string& path, std::vector<KeyDoc> rows) {
    for (KeyDoc& row : rows) {
        row.name = fmt::format("{}.{}", path, row.name);
        for (auto list = row.name.find("[]."); list != std::string::npos; list = row.name.find("[]."))
            row.name.replace(list, 2, "[0]");
        keys.push_back(std::move(row));
    }
}

// The path of a section by its header: step[0] for "[[step]] model = ...", flux for "[flux]".
std::string path_of(const std::string& header) {
    const bool list = header.starts_with("[[");
    const std::size_t begin = list ? 2 : 1;
    return fmt::format("{}{}", header.substr(begin, header.find(']') - begin), list ? "[0]" : "");
}

}  // namespace

std::vector<Key> keys_of(DomainSection& domain) {
    return {
        {"extent", std::span<double>(domain.extent), kLength,
         "lateral size along x and y, centred on 0. One number, such as [10.0], makes a profile in x and "
         "z: the wafer is the same at all y, costs as much as one row of cells, and volumes become areas; "
         "not for shapes that are round or end along y, nor for roughness along a line. \"gds\": the "
         "bounding box of the layout layers that the masks use, in whole cells; box and masks are moved so "
         "that its centre is at 0. \"gds:63/0\": the bounding box of layer 63, datatype 0 of these layouts "
         "instead",
         required({.min = 0.0, .above_min = true, .size = 1})},
        {"grid_spacing", &domain.grid_spacing, kLength,
         "size of a grid cell; rounded so that both extents are whole numbers of cells", required(kPositive)},
        {"padding", &domain.padding, kLength,
         "with extent = \"gds\" or [cut]: margin around the layout on every side, or at both ends of the "
         "line; default 0",
         kNotNegative},
        {"boundary", choice(domain.boundary, {"reflective", "periodic"}), "",
         "how the domain continues beyond its sides across x and across y; one word is for both. A profile "
         "needs one word; across y it is always periodic"},
        {"symmetry", choice(domain.symmetry, {"none", "axial"}), "",
         "axial: a wafer that is round about the z axis, as a profile in r (the x of the recipe, 0 to the "
         "extent) and z: a hole lies at the axis, a trench becomes a ring. Particles fly in three "
         "dimensions; volumes are those of the whole body of revolution. The outer side is a mirror; for "
         "an array of holes give the radius of the circle with the area of its unit cell"},
        {"strip", choice(domain.strip, {"auto", "profile", "space"}), "",
         "how a wafer of two extents that is the same along y is computed. profile: as a profile in x and "
         "z, with files and volumes of the full width; space: in three dimensions; auto: as a profile if y "
         "has at most eight cells and all layers and patterns are the same along it, unless a cut along y, "
         "line roughness, grid levels or a law that depends on position needs three dimensions"},
        {"length_unit", &domain.length_unit, "", "unit of every length", one_of(length_units())},
        {"time_unit", &domain.time_unit, "", "unit of every time", one_of(time_units())},
    };
}

std::vector<Key> keys_of(CutSection& cut) {
    return {
        {"layer", &cut.layer, "",
         "layer and datatype of the masks' layout on which the line is drawn, such as \"63/0\". The line "
         "is a path of two points or a box, at most a quarter as wide as it is long; it becomes the "
         "extent, x growing from left to right or upward",
         required()},
        {"line", &cut.line, "",
         "number of the line on that layer, from 1 in the file's order; default: the only line",
         within(0.0, 1e9)},
    };
}

std::vector<Key> keys_of(GridSection& grid) {
    return {
        {"levels",
         &grid.levels,
         "",
         "number of grid levels, each with twice the spacing of the one before. Finer levels are used only "
         "in columns of the wafer that a coarser one cannot resolve, because of edges, gaps or speeds that "
         "change along the surface; auto: up to 3, as many as the domain's cells allow",
         {.min = 1.0, .max = 3.0, .whole = true, .word = "auto"}},
    };
}

std::vector<Key> keys_of(StartSection& start) {
    return {
        {"from", &start.from, "",
         "folder of an earlier run of the same domain, relative to the recipe or to the working folder",
         required()},
        {"time", &start.time, kTime,
         "process time in that run at which it saved a surface; \"end\": the end of the run",
         or_word("end", kNotNegative)},
        {"step", &start.step, "",
         "instead of time: number of the step in that run at whose end it saved a surface, from 1 with "
         "loops unrolled; 0 = by time",
         within(0.0, 100'000)},
    };
}

std::vector<Key> keys_of(Material& material) {
    return {
        {"name", &material.name, "", "a new material, or a built-in one to change", required()},
        {"colour", &material.colour, "", "colour in pictures, as #rrggbb"},
        {"density", &material.density, "1e22 /cm^3",
         "number density of atoms, or of formula units of a compound", kPositive},
    };
}

std::vector<Key> keys_of(FluxSection& flux) {
    return {
        {"method", &flux.method, "",
         "monte-carlo follows particles from the source. radiosity traces rays between points of the "
         "surface once and solves the balance of all neutrals that are re-emitted diffusely; other species "
         "stay with monte-carlo. auto takes for each species the method estimated to cost less at the "
         "start of every step; with `rays`, radiosity then traces to the error that so many particles had",
         one_of({"auto", "monte-carlo", "radiosity"})},
        {"accuracy",
         &flux.accuracy,
         "",
         "relative standard error that noise of the fluxes may cause in the distance that a step moves the "
         "surface, such as a depth or a film thickness, where it is largest; time steps trace as many rays "
         "as that takes",
         {.min = 1e-4, .max = 0.2}},
        {"rays", &flux.rays, "",
         "instead of accuracy: source rays per species and time step, 100 or more; radiosity traces this "
         "many for all its species together, with method = \"auto\" up to four times as many; 0 = as many "
         "as accuracy needs",
         within(0.0, 1e12)},
        {"relative_error", &flux.relative_error, "",
         "instead of accuracy and rays: trace until sum(area * standard error) / sum(area * flux) is this small",
         or_word("none", positive_to(0.5))},
        {"max_rays", &flux.max_rays, "",
         "most rays per species and time step that accuracy or relative_error may use",
         within(kFewestRays, 1e12)},
        {"batches", &flux.batches, "",
         "number of independent batches of rays, whose scatter gives the standard errors",
         within(16.0, 65536.0)},
        {"seed", &flux.seed, "", "seed of the random numbers", within(0.0, 4.0e18)},
        {"memory", &flux.memory, "GB", "most memory for the rays of radiosity, which traces no more than fit",
         within(1e-3, 1e6)},
        {"reuse", &flux.reuse, "",
         "fluxes are reused in further time steps while they change by less than this share of their mean; "
         "0 = trace every time step",
         within(0.0, 0.5)},
        {"averaging", &flux.averaging, kLength,
         "models use fluxes averaged over the surface within this distance, 0.25 to 8 grid spacings; 0 = "
         "as traced, with noise reduced where few particles arrive",
         kNotNegative},
        {"stages", &flux.stages, "",
         "step: fluxes are traced once a time step and extrapolated from the one before; all: they are "
         "traced at every stage of advection.time_integration, which gives the order of rk2 or rk3 where "
         "fluxes change smoothly",
         one_of({"step", "all"})},
    };
}

std::vector<Key> keys_of(SimplifySection& simplify) {
    return {
        {"method", &simplify.method, "",
         "how the surface mesh is coarsened before fluxes are traced; auto: region-bounded in three "
         "dimensions if all species are neutrals with sticking of at most 0.5 and coarsening saves more "
         "time than it takes, else none",
         one_of({"auto", "none", "lindstrom-turk", "region", "region-bounded", "cgal-lindstrom-turk"})},
        {"l0", &simplify.l0, kLength,
         "mesh edges shorter than this collapse everywhere, at features (creases, strong curvature) too; 0 "
         "keeps features as they are; auto: the grid spacing",
         kLengthOrAuto},
        {"step", &simplify.step, kLength,
         "increase of the allowed edge length, l0 at features, per ring of vertices away from them; auto: "
         "the grid spacing",
         kLengthOrAuto},
        {"l_max", &simplify.l_max, kLength,
         "mesh edges longer than this never collapse; auto: 3 grid spacings, lindstrom-turk 2",
         kLengthOrAuto},
        {"feature_parameter", &simplify.feature_parameter, "",
         "C: features are where the mean curvature |H| > C/dx or the Gaussian curvature |K| > (C/dx)^2, dx "
         "being the grid spacing; auto: from the distribution of curvature",
         kAboveZeroOrAuto},
        {"weights",
         &simplify.weights,
         "",
         "weights of volume, boundary and shape in the Lindstrom-Turk cost; default: those of the method",
         {.min = 0.0, .max = 1e6, .size = 3}},
        {"target_vertices", &simplify.target_vertices, "",
         "number of vertices at which coarsening stops, beyond l_max if necessary; 0 = no target: the "
         "lengths decide",
         within(0.0, 1e12)},
        {"max_error", &simplify.max_error, kLength,
         "upper bound of the distance between coarsened and extracted surface; auto: 0.05 grid spacings "
         "for region-bounded without target_vertices, else none",
         kAboveZeroOrAuto},
        {"flux_change", &simplify.flux_change, "",
         "region-bounded: edges stay so short that no flux of the time step before changes by more than "
         "this share along one; 0 = no such limit",
         within(0.0, 2.0)},
    };
}

std::vector<Key> keys_of(levelset::AdvectionOptions& advection) {
    return {
        {"scheme", choice(advection.scheme, {"engquist_osher", "weno3", "weno5", "lax_friedrichs"}), "",
         "spatial discretisation; speeds that depend on the surface normal, as under beams and on "
         "crystals, use schemes of their own instead"},
        {"time_integration", choice(advection.time_integration, {"euler", "rk2", "rk3"}), "",
         "time integration: forward Euler, or Runge-Kutta of order 2 or 3"},
        {"cfl", &advection.cfl, "",
         "largest distance that the surface moves in a time step, in grid spacings", within(kLeastCfl, 0.5)},
    };
}

std::vector<Key> keys_of(OutputSection& output) {
    return {
        {"every", &output.every, kTime,
         "process time between saved surfaces; \"end\" saves the wafer after every step",
         or_word("end", kPositive)},
        {"profiles", &output.profiles, "",
         "planes in which the surface's profile is saved as CSV, such as \"y=0\" or \"x=-1.5\""},
    };
}

std::vector<Key> keys_of(MetrologySection& metrology) {
    return {
        {"measures", &metrology.measures, "",
         "depth, cd, sidewall_angle, bow, undercut, aspect_ratio, scallops, film, voids, seam_depth; or "
         "figures by name: cd_at_D (width of the opening), cd_MATERIAL_at_D (width of the material), "
         "thickness_MATERIAL_at_X (vertical), wall_MATERIAL_at_D (thickness on the opening's walls), "
         "recess_MATERIAL (how far it lies behind the opening's narrowest place), ler_at_D and lwr_at_D (3 "
         "sigma of the edges and of the width of the line across the cut), volume_MATERIAL. D is a depth "
         "below z = 0, negative above it; X is a position along the cut. FIGURE_without_MATERIAL, such as "
         "cd_at_0.5_without_Polymer, is the figure as it would be after a strip of that material"},
        {"cd_depths", &metrology.cd_depths, kLength,
         "depths below z = 0, negative above it, at which cd is measured"},
        {"mask_bottom", &metrology.mask_bottom, kLength,
         "z of the mask's underside, below which undercut is measured"},
        {"cut", &metrology.cut, "", "vertical plane in which the measures are taken"},
    };
}

std::vector<SectionDoc> recipe_documentation() {
    std::vector<SectionDoc> docs;
    docs.push_back(section<DomainSection>("domain", "[domain]", "the simulated box and the units"));
    docs.push_back(section<CutSection>(
        "cut line", "[cut]",
        "a profile along a line drawn in the layout of the masks, instead of domain.extent"));
    docs.push_back(section<GridSection>("grid", "[grid]", "local refinement of the grid"));
    docs.push_back(section<StartSection>(
        "start", "[start]", "begins with the wafer of an earlier run; takes the place of layers"));
    docs.push_back(section<Material>("material", "[[material]]",
                                     "more materials, or other properties of built-in ones"));
    for (const std::string& shape : shape_names()) {
        Layer layer;
        layer.shape = shape;
        docs.push_back(
            chosen(section("layer " + shape, "[[layer]] shape = \"" + shape + "\"",
                           "layers from the substrate up; each is united with those below it", layer),
                   "shape", shape));
    }
    docs.push_back(section<Step>("loop", "[[step]] with [[step.steps]]",
                                 "a loop, whose steps run in turn, as often as repeat says"));
    for (const ModelEntry& model : models()) {
        Step step;
        step.model = model.name;
        step.parameters = model.defaults;
        step.pattern.shape.clear();  // no shape: the keys of all shapes
        docs.push_back(chosen(section(model.name, "[[step]] model = \"" + model.name + "\"", model.doc, step),
                              "model", model.name));
        docs.back().more = model.more;
    }
    docs.push_back(
        section<FluxSection>("flux", "[flux]", "how the particle fluxes on the surface are computed"));
    docs.push_back(section<SimplifySection>("simplify", "[simplify]", "coarsening of the traced surface"));
    docs.push_back(section<levelset::AdvectionOptions>("advection", "[advection]",
                                                       "how the surface is moved by the speeds"));
    docs.push_back(section<OutputSection>("output", "[output]", "what is saved"));
    docs.push_back(
        section<MetrologySection>("metrology", "[metrology]", "what is measured, for summary and timeline"));
    return docs;
}

std::vector<KeyDoc> settable_keys(Recipe recipe) {
    std::vector<KeyDoc> keys;
    for (SectionDoc& section : recipe_documentation())
        if (!section.header.starts_with("[[")) add(keys, path_of(section.header), std::move(section.keys));
    for (std::size_t i = 0; i < recipe.layers.size(); ++i)
        add(keys, fmt::format("layer[{}]", i), document(keys_of(recipe.layers[i])));
    each_step(recipe.steps,
              [&](Step& step, const std::string& path) { add(keys, path, document(keys_of(step))); });
    const std::vector<NamedStep> named = named_steps(recipe.steps);
    for (const NamedStep& step : named) {
        const auto same = [&](const NamedStep& other) { return other.name == step.name; };
        if (std::count_if(named.begin(), named.end(), same) > 1) continue;
        for (std::size_t k = 0, count = keys.size(); k < count; ++k) {
            const std::string rest = keys[k].name.substr(std::min(step.path.size(), keys[k].name.size()));
            if (!keys[k].name.starts_with(step.path + ".") || rest.starts_with(".steps[")) continue;
            KeyDoc key = keys[k];
            key.name = path_by_name(step.name) + rest;
            keys.push_back(std::move(key));
        }
    }
    return keys;
}

std::vector<KeyDoc> settable_keys() {
    std::vector<KeyDoc> keys;
    for (SectionDoc& section : recipe_documentation())
        add(keys, path_of(section.header), std::move(section.keys));
    std::set<std::string> seen;  // shapes and models share keys
    std::erase_if(keys, [&](const KeyDoc& key) { return !seen.insert(key.name).second; });
    return keys;
}

}  // namespace sidewall::app
