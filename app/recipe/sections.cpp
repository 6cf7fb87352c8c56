#include "app/recipe/sections.hpp"

#include "app/models/model.hpp"
#include "app/schema/units.hpp"

namespace sidewall::app {
namespace {

const std::string kLength = "length", kTime = "time";

// Fewer rays leave the flux an error of over a third even on the smallest grid.
constexpr double kFewestRays = 100.0;
// Shorter time steps only add rounding: the front would need a thousand of them to pass a cell.
constexpr double kLeastCfl = 1e-3;

const Rule kLengthOrAuto{.min = 0.0, .word = "auto"};
const Rule kAboveZeroOrAuto{.min = 0.0, .above_min = true, .word = "auto"};

template <class Section>
SectionDoc section(std::string name, std::string header, std::string doc, Section defaults = {}) {
    return {std::move(name), std::move(header), std::move(doc), document(fields(defaults))};
}

// The word that chooses a section stands for all the words there are.
SectionDoc chosen(SectionDoc doc, const std::string& key, const std::string& word) {
    for (KeyDoc& row : doc.keys)
        if (row.name == key) row.type = toml_text(word);
    return doc;
}

}  // namespace

std::vector<Field> fields(DomainSection& domain) {
    return {
        {"extent", std::span<double>(domain.extent), kLength,
         "lateral x and y size, centred on 0; x alone, as [10.0]: a profile in x and z, the same at all y, one cell "
         "wide and as cheap, its volumes areas. Not for what is round or ends along y, nor where a rough edge or a "
         "grain of noise shall not be the same all along a line. \"gds\": the box around the layouts' layers that masks "
         "name, in whole cells, whose centre the masks are moved to 0 by",
         required({.min = 0.0, .above_min = true, .size = 1})},
        {"grid_spacing", &domain.grid_spacing, kLength,
         "rounded so that both extents are whole numbers of cells", required(kPositive)},
        {"padding", &domain.padding, kLength,
         "with extent = \"gds\": around the layouts, on every side; default 0", kNotNegative},
        {"boundary", choice(domain.boundary, {"reflective", "periodic"}), "",
         "sides across x and across y; of a profile across x, the others are periodic"},
        {"length_unit", &domain.length_unit, "", "unit of every length", {.choices = length_units()}},
        {"time_unit", &domain.time_unit, "", "unit of every time", {.choices = time_units()}},
    };
}

std::vector<Field> fields(GridSection& grid) {
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

std::vector<Field> fields(StartSection& start) {
    return {
        {"from", &start.from, "",
         "folder of an earlier run of the same domain, relative to the recipe or to where the program runs",
         required()},
        {"time",
         &start.time,
         kTime,
         "process time there, one that it saved a surface at; \"end\": where it ended",
         {.min = 0.0, .word = "end"}},
        {"step",
         &start.step,
         "",
         "or the step, from 1 with loops unrolled, at whose end it saved a surface; 0 = by time",
         {.min = 0.0, .max = 100'000}},
    };
}

std::vector<Field> fields(Material& material) {
    return {
        {"name", &material.name, "", "a new material, or a built-in one to change", required()},
        {"colour", &material.colour, "", "in pictures, #rrggbb"},
        {"density", &material.density, "1e22 /cm^3", "atoms, or formula units of a compound", kPositive},
    };
}

const std::vector<std::string>& measure_names() {
    static const std::vector<std::string> names = {"depth",    "cd",           "sidewall_angle", "bow",
                                                   "undercut", "aspect_ratio", "scallops",       "film"};
    return names;
}

std::vector<Field> fields(Step& step) {
    std::vector<Field> list = {{"name", &step.name, "", "what reports call it"},
                               {"repeat", &step.repeat, "", "times to run it", {.min = 1, .max = 100'000}}};
    const ModelEntry* model = find_model(step.model);
    if (model == nullptr) return list;
    list.insert(
        list.begin(),
        {"model", &step.model, "", "see the models below", {.required = true, .choices = model_names()}});
    if (model->make != nullptr) {  // a geometric step takes no time
        list.push_back({"duration", &step.duration, kTime, "process time, at most", required(kPositive)});
        list.push_back({"stop_depth", &step.stop_depth, kLength,
                        "ends the step when the lowest point is that far below z = 0"});
        list.push_back({"stop_material",
                        &step.stop_material,
                        "",
                        "ends the step when this material is bare",
                        {.material = true}});
        list.push_back({"stop_thickness", &step.stop_thickness, kLength,
                        "ends the step when the uppermost layer is that thick somewhere", kPositive});
        static const std::vector<Key> stop{
            {"stop", std::string(), "",
             "ends the step when a figure of [metrology] measures is above or below a value, e.g. \"depth > 2.0\" or "
             "\"cd_SiO2_at_0.5 < 0.3\", in the recipe's units; lengths and volumes within a twentieth of a grid "
             "spacing of the front's way, angles and ratios at the end of the time step"}};
        for (Field& field : bind(stop, step.values)) list.push_back(std::move(field));
    }
    for (Field& field : bind(model->keys, step.values)) list.push_back(std::move(field));
    if (model->patterned)
        for (Field& field : pattern_fields(step.pattern)) list.push_back(std::move(field));
    return list;
}

std::vector<Field> fields(FluxSection& flux) {
    return {
        {"method",
         &flux.method,
         "",
         "monte-carlo follows particles from the source; radiosity gathers rays between points of the surface "
         "once and solves for all neutrals that are re-emitted diffusely, others stay with monte-carlo; auto "
         "takes what is estimated to cost less, by species, at the start of every step, radiosity then to the "
         "error that `rays` paths had there",
         {.choices = {"monte-carlo", "radiosity", "auto"}}},
        {"rays",
         &flux.rays,
         "",
         "source rays a species and time step; radiosity gathers as many for all its species together, auto "
         "up to four times as many for their error",
         {.min = kFewestRays, .max = 1e12}},
        {"relative_error",
         &flux.relative_error,
         "",
         "instead of rays: trace until sum(area * standard error) / sum(area * flux) is this small",
         {.min = 0.0, .max = 0.5, .above_min = true, .word = "none"}},
        {"max_rays",
         &flux.max_rays,
         "",
         "the most that relative_error may spend a species and time step",
         {.min = kFewestRays, .max = 1e12}},
        {"batches",
         &flux.batches,
         "",
         "independent parts of the rays, whose scatter gives the standard errors",
         {.min = 16.0, .max = 65536.0}},
        {"seed", &flux.seed, "", "of the random numbers", {.min = 0.0, .max = 4.0e18}},
        {"memory",
         &flux.memory,
         "GB",
         "that the rays of radiosity may take; it gathers no more",
         {.min = 1e-3, .max = 1e6}},
        {"reuse",
         &flux.reuse,
         "",
         "fluxes serve further time steps for as long as they change by less than this share of their mean; "
         "0 = trace every time step",
         {.min = 0.0, .max = 0.5}},
        {"averaging", &flux.averaging, kLength,
         "models see fluxes averaged over the surface within this distance, 0.25 to 8 grid spacings; 0 = as "
         "traced, less noise",
         kNotNegative},
        {"stages",
         &flux.stages,
         "",
         "step: fluxes as of the start of a time step; all: traced again at every stage of "
         "advection.time_integration, the order of rk2 or rk3 where fluxes change smoothly",
         {.choices = {"step", "all"}}},
    };
}

std::vector<Field> fields(SimplifySection& simplify) {
    return {
        {"method",
         &simplify.method,
         "",
         "what coarsens the surface before its flux is traced",
         {.choices = {"none", "lindstrom-turk", "region", "region-bounded", "cgal-lindstrom-turk"}}},
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
        {"target_vertices",
         &simplify.target_vertices,
         "",
         "stop at this many, whatever that does to the surface; 0 = as the lengths say",
         {.min = 0.0, .max = 1e12}},
        {"max_error", &simplify.max_error, kLength,
         "hard bound on the distance to the extracted surface; auto: region-bounded without target_vertices 0.05 "
         "dx, else none",
         kAboveZeroOrAuto},
        {"flux_change",
         &simplify.flux_change,
         "",
         "region-bounded: along no longer edge did a flux change by more than this share of itself in the time "
         "step before; 0 = any",
         {.min = 0.0, .max = 2.0}},
    };
}

std::vector<Field> fields(levelset::AdvectionOptions& advection) {
    return {
        {"scheme", choice(advection.scheme, {"engquist_osher", "weno3", "weno5", "lax_friedrichs"}), "",
         "how space is discretised; a speed that depends on the normal always takes lax_friedrichs"},
        {"time_integration", choice(advection.time_integration, {"euler", "rk2", "rk3"}), "", "how time is"},
        {"cfl",
         &advection.cfl,
         "",
         "grid spacings the front may move a time step",
         {.min = kLeastCfl, .max = 0.5}},
    };
}

std::vector<Field> fields(OutputSection& output) {
    return {
        {"every",
         &output.every,
         kTime,
         "between saved surfaces; \"end\" saves one a step",
         {.min = 0.0, .above_min = true, .word = "end"}},
        {"profiles", &output.profiles, "", "planes to cut the surface by, such as \"y=0\" or \"x=-1.5\""},
    };
}

std::vector<Field> fields(MetrologySection& metrology) {
    return {
        {"measures", &metrology.measures, "",
         "depth, cd, sidewall_angle, bow, undercut, aspect_ratio, scallops, film; or by name, D being a depth below z = 0, "
         "negative above it, X a place along the cut: cd_at_D (opening), cd_MATERIAL_at_D (width of the material), "
         "thickness_MATERIAL_at_X, wall_MATERIAL_at_D (beside the opening), recess_MATERIAL (behind the narrowest "
         "place), ler_at_D and lwr_at_D (3 sigma of edges and width across the cut), volume_MATERIAL"},
        {"cd_depths", &metrology.cd_depths, kLength, "below z = 0, negative above it, where cd is taken"},
        {"mask_bottom", &metrology.mask_bottom, kLength, "z below which undercut is measured"},
        {"cut", &metrology.cut, "", "vertical plane to measure in"},
    };
}

std::vector<SectionDoc> recipe_documentation() {
    std::vector<SectionDoc> docs;
    docs.push_back(section<DomainSection>("domain", "[domain]", "the simulated box and the units"));
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

}  // namespace sidewall::app
