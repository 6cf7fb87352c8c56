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

// Fewer rays leave the flux an error of over a third even on the smallest grid.
constexpr double kFewestRays = 100.0;
// Shorter time steps only add rounding: the front would need a thousand of them to pass a cell.
constexpr double kLeastCfl = 1e-3;

const Rule kLengthOrAuto = or_word("auto", kNotNegative);
const Rule kAboveZeroOrAuto = or_word("auto", kPositive);

template <class Section>
SectionDoc section(std::string name, std::string header, std::string doc, Section defaults = {}) {
    return {std::move(name), std::move(header), std::move(doc), document(keys_of(defaults))};
}

// The word that chooses a section stands for all the words there are.
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

void add_steps(std::vector<KeyDoc>& keys, const std::string& path, std::vector<Step>& steps) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const std::string step = fmt::format("{}[{}]", path, i);
        add(keys, step, document(keys_of(steps[i])));
        add_steps(keys, step + ".steps", steps[i].steps);
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
         "lateral x and y size, centred on 0; x alone, as [10.0]: a profile in x and z, the same at all y, one cell "
         "wide and as cheap, its volumes areas. Not for what is round or ends along y, nor where a rough edge or a "
         "grain of noise shall not be the same all along a line. \"gds\": the box around the layouts' layers that masks "
         "name, in whole cells, whose centre the masks are moved to 0 by; \"gds:63/0\": around layer 63, datatype 0 of "
         "these layouts instead",
         required({.min = 0.0, .above_min = true, .size = 1})},
        {"grid_spacing", &domain.grid_spacing, kLength,
         "rounded so that both extents are whole numbers of cells", required(kPositive)},
        {"padding", &domain.padding, kLength,
         "with extent = \"gds\" or [cut]: around the layouts, on every side; default 0", kNotNegative},
        {"boundary", choice(domain.boundary, {"reflective", "periodic"}), "",
         "sides across x and across y; one word is for both, and all that a profile needs: its other sides are periodic"},
        {"symmetry", choice(domain.symmetry, {"none", "axial"}), "",
         "axial: the profile of a round wafer in r = x, from 0 to the extent, and z: a hole at its middle, rings around it. "
         "Particles fly in space, volumes are of the revolution; a mirror is at the axis, and one all around at the extent, "
         "for which the radius of a round cell of the same area stands for an array's"},
        {"strip", choice(domain.strip, {"auto", "profile", "space"}), "",
         "profile: runs a wafer of two extents as a profile in x and z, with the files and volumes of the strip; auto: does "
         "so where y has at most eight cells and all layers and patterns are the same along it, unless a cut along y, line "
         "roughness, levels or a law of the place asks for space; space: never"},
        {"length_unit", &domain.length_unit, "", "unit of every length", one_of(length_units())},
        {"time_unit", &domain.time_unit, "", "unit of every time", one_of(time_units())},
    };
}

std::vector<Key> keys_of(CutSection& cut) {
    return {
        {"layer", &cut.layer, "",
         "\"63/0\", say: the layer and the datatype of the masks' layout that hold the line, a path of two points or a "
         "box, at most a quarter as wide as it is long; it becomes the extent, from left to right or upward",
         required()},
        {"line", &cut.line, "",
         "which of the layer's lines, from 1 in the file's order; default the only one", within(0.0, 1e9)},
    };
}

std::vector<Key> keys_of(GridSection& grid) {
    return {
        {"levels",
         &grid.levels,
         "",
         "of the grid, each with twice the spacing of the one before: the finest counts in columns of the wafer that "
         "have what a coarser one cannot hold, such as edges, gaps or speeds that change along the surface; auto: up to "
         "3, as many as the domain's cells allow",
         {.min = 1.0, .max = 3.0, .whole = true, .word = "auto"}},
    };
}

std::vector<Key> keys_of(StartSection& start) {
    return {
        {"from", &start.from, "",
         "folder of an earlier run of the same domain, relative to the recipe or to where the program runs",
         required()},
        {"time", &start.time, kTime,
         "process time there, one that it saved a surface at; \"end\": where it ended",
         or_word("end", kNotNegative)},
        {"step", &start.step, "",
         "or the step, from 1 with loops unrolled, at whose end it saved a surface; 0 = by time",
         within(0.0, 100'000)},
    };
}

std::vector<Key> keys_of(Material& material) {
    return {
        {"name", &material.name, "", "a new material, or a built-in one to change", required()},
        {"colour", &material.colour, "", "in pictures, #rrggbb"},
        {"density", &material.density, "1e22 /cm^3", "atoms, or formula units of a compound", kPositive},
    };
}

std::vector<Key> keys_of(FluxSection& flux) {
    return {
        {"method", &flux.method, "",
         "monte-carlo follows particles from the source; radiosity gathers rays between points of the surface "
         "once and solves for all neutrals that are re-emitted diffusely, others stay with monte-carlo; auto "
         "takes what is estimated to cost less, by species, at the start of every step, radiosity then to the "
         "error that `rays` paths had there",
         one_of({"auto", "monte-carlo", "radiosity"})},
        {"accuracy",
         &flux.accuracy,
         "",
         "standard error, as a share, that noise may leave in what a step moves, such as its depth or its film, where it is "
         "worst: time steps trace as many rays as that takes",
         {.min = 1e-4, .max = 0.2}},
        {"rays", &flux.rays, "",
         "instead of accuracy: source rays a species and time step, 100 or more; radiosity gathers as many for all its "
         "species together, auto up to four times as many for their error; 0 = as accuracy asks",
         within(0.0, 1e12)},
        {"relative_error", &flux.relative_error, "",
         "instead of accuracy and rays: trace until sum(area * standard error) / sum(area * flux) is this small",
         or_word("none", positive_to(0.5))},
        {"max_rays", &flux.max_rays, "",
         "the most that accuracy or relative_error may spend a species and time step",
         within(kFewestRays, 1e12)},
        {"batches", &flux.batches, "",
         "independent parts of the rays, whose scatter gives the standard errors", within(16.0, 65536.0)},
        {"seed", &flux.seed, "", "of the random numbers", within(0.0, 4.0e18)},
        {"memory", &flux.memory, "GB", "that the rays of radiosity may take; it gathers no more",
         within(1e-3, 1e6)},
        {"reuse", &flux.reuse, "",
         "fluxes serve further time steps for as long as they change by less than this share of their mean; "
         "0 = trace every time step",
         within(0.0, 0.5)},
        {"averaging", &flux.averaging, kLength,
         "models see fluxes averaged over the surface within this distance, 0.25 to 8 grid spacings; 0 = as "
         "traced, less noise",
         kNotNegative},
        {"stages", &flux.stages, "",
         "step: one trace a time step, gone on from the one before; all: traced again at every stage of "
         "advection.time_integration, the order of rk2 or rk3 where fluxes change smoothly",
         one_of({"step", "all"})},
    };
}

std::vector<Key> keys_of(SimplifySection& simplify) {
    return {
        {"method", &simplify.method, "",
         "what coarsens the surface before its flux is traced; auto: region-bounded in space where all species are neutrals "
         "that mostly do not stick and tracing gains more than it costs, else none",
         one_of({"auto", "none", "lindstrom-turk", "region", "region-bounded", "cgal-lindstrom-turk"})},
        {"l0", &simplify.l0, kLength, "edges shorter than this collapse everywhere; 0 leaves features alone",
         kLengthOrAuto},
        {"step", &simplify.step, kLength, "growth of that length a ring away from features", kLengthOrAuto},
        {"l_max", &simplify.l_max, kLength, "no longer edge collapses", kLengthOrAuto},
        {"feature_parameter", &simplify.feature_parameter, "",
         "C: a feature has |H| > C/dx or |K| > (C/dx)^2; auto: from the distribution of curvature",
         kAboveZeroOrAuto},
        {"weights",
         &simplify.weights,
         "",
         "volume, boundary and shape in the Lindstrom-Turk cost; default the method's",
         {.min = 0.0, .max = 1e6, .size = 3}},
        {"target_vertices", &simplify.target_vertices, "",
         "stop at this many, whatever that does to the surface; 0 = as the lengths say", within(0.0, 1e12)},
        {"max_error", &simplify.max_error, kLength,
         "hard bound on the distance to the extracted surface; auto: region-bounded without target_vertices 0.05 "
         "dx, else none",
         kAboveZeroOrAuto},
        {"flux_change", &simplify.flux_change, "",
         "region-bounded: along no longer edge did a flux change by more than this share of itself in the time "
         "step before; 0 = any",
         within(0.0, 2.0)},
    };
}

std::vector<Key> keys_of(levelset::AdvectionOptions& advection) {
    return {
        {"scheme", choice(advection.scheme, {"engquist_osher", "weno3", "weno5", "lax_friedrichs"}), "",
         "how space is discretised; a speed that depends on the normal always takes lax_friedrichs"},
        {"time_integration", choice(advection.time_integration, {"euler", "rk2", "rk3"}), "", "how time is"},
        {"cfl", &advection.cfl, "", "grid spacings the front may move a time step", within(kLeastCfl, 0.5)},
    };
}

std::vector<Key> keys_of(OutputSection& output) {
    return {
        {"every", &output.every, kTime, "between saved surfaces; \"end\" saves the wafer after every step",
         or_word("end", kPositive)},
        {"profiles", &output.profiles, "", "planes to cut the surface by, such as \"y=0\" or \"x=-1.5\""},
    };
}

std::vector<Key> keys_of(MetrologySection& metrology) {
    return {
        {"measures", &metrology.measures, "",
         "depth, cd, sidewall_angle, bow, undercut, aspect_ratio, scallops, film, voids, seam_depth; or by name, D being a depth below z = 0, "
         "negative above it, X a place along the cut: cd_at_D (opening), cd_MATERIAL_at_D (width of the material), "
         "thickness_MATERIAL_at_X, wall_MATERIAL_at_D (beside the opening), recess_MATERIAL (behind the narrowest "
         "place), ler_at_D and lwr_at_D (3 sigma of edges and width across the cut), volume_MATERIAL; FIGURE_without_MATERIAL, such as cd_at_0.5_without_Polymer, is "
         "any of them after a strip of the material"},
        {"cd_depths", &metrology.cd_depths, kLength, "below z = 0, negative above it, where cd is taken"},
        {"mask_bottom", &metrology.mask_bottom, kLength, "z below which undercut is measured"},
        {"cut", &metrology.cut, "", "vertical plane to measure in"},
    };
}

std::vector<SectionDoc> recipe_documentation() {
    std::vector<SectionDoc> docs;
    docs.push_back(section<DomainSection>("domain", "[domain]", "the simulated box and the units"));
    docs.push_back(section<CutSection>(
        "cut line", "[cut]",
        "a profile along a line drawn in the layout of the masks, instead of domain.extent"));
    docs.push_back(section<GridSection>("grid", "[grid]", "where the grid is fine"));
    docs.push_back(section<StartSection>(
        "start", "[start]", "begins with the wafer of an earlier run; takes the place of layers"));
    docs.push_back(section<Material>("material", "[[material]]",
                                     "more materials, or other properties of built-in ones"));
    for (const std::string& shape : shape_names()) {
        Layer layer;
        layer.shape = shape;
        docs.push_back(chosen(section("layer " + shape, "[[layer]] shape = \"" + shape + "\"",
                                      "bottom up; each is united with those below it", layer),
                              "shape", shape));
    }
    docs.push_back(
        section<Step>("loop", "[[step]] with [[step.steps]]", "steps of its own, run again and again"));
    for (const ModelEntry& model : models()) {
        Step step;
        step.model = model.name;
        step.parameters = model.defaults;
        step.pattern.shape.clear();  // all shapes' keys
        docs.push_back(chosen(section(model.name, "[[step]] model = \"" + model.name + "\"", model.doc, step),
                              "model", model.name));
        docs.back().more = model.more;
    }
    docs.push_back(section<FluxSection>("flux", "[flux]", "what arrives on the surface"));
    docs.push_back(section<SimplifySection>("simplify", "[simplify]", "coarsening of the traced surface"));
    docs.push_back(section<levelset::AdvectionOptions>("advection", "[advection]", "how the front is moved"));
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
    add_steps(keys, "step", recipe.steps);
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
