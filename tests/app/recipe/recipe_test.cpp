#include "app/recipe/recipe.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/notes.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <limits>

#include "app/recipe/layers.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/steps.hpp"
#include "tests/app/recipe/gds_bytes.hpp"
#include "tests/folder.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

const std::string kBase = R"([domain]
extent = [10.0, 10.0]
grid_spacing = 0.24
[[layer]]
material = "Si"
shape = "trench"
width = 4.0
depth = 8.0
[[step]]
model = "single_particle"
duration = 5.0
rate = 1.0
sticking = { Si = 0.2, default = 0.1 }
deposit = "SiO2"
)";

Recipe with(const std::vector<std::string>& overrides) {
    return parse_recipe(kBase, "base.toml", overrides);
}

std::string message(const std::string& text, const std::vector<std::string>& overrides = {}) {
    try {
        parse_recipe(text, "bad.toml", overrides);
    } catch (const RecipeError& error) {
        return error.what();
    }
    return "accepted";
}

// A recipe with every shape, a loop in a loop, every model, own materials and no key at its default.
const std::string kRich = R"([domain]
extent = [6.0, 3.0]
grid_spacing = 0.1
boundary = ["periodic", "reflective"]
length_unit = "nm"
time_unit = "min"
[grid]
levels = 2
[[material]]
name = "Low-k"
colour = "#010203"
density = 1.5
[[material]]
name = "Si"
density = 4.9
[[layer]]
material = "Si"
shape = "hole"
radius = 1.0
depth = 2.0
taper_deg = -3.0
position = [0.5, -0.25]
[[layer]]
shape = "stack"
materials = ["SiO2", "Si3N4"]
thicknesses = [0.2, 0.1]
repeat = 4
[[layer]]
material = "Low-k"
shape = "trench"
thickness = 0.5
width = 1.0
[[layer]]
material = "W"
shape = "fin"
width = 0.3
height = 0.7
[[layer]]
material = "TiN"
shape = "box"
size = [0.3, 0.2]
height = 0.7
top = 2.0
[[step]]
name = "outer \"loop\""
repeat = 3
[[step.steps]]
repeat = 2
[[step.steps.steps]]
model = "isotropic"
duration = 1.0
rate = { Low-k = 1e-3, default = 0.5 }
deposit = "Polymer"
[[step.steps]]
model = "directional"
duration = 0.1
directional = -1
isotropic = { Si = -0.25 }
direction = [0.1, 0, 1]
visibility = false
[[step]]
model = "multi_particle"
duration = 2
repeat = 2
species = [{ name = "ion", kind = "collimated", rate = -1, source_exponent = 200 }, { name = "n", rate = { W = 0.1 }, sticking = 0.5 }]
deposit = "Low-k"
[flux]
rays = 1e4
seed = 7
[simplify]
method = "region-bounded"
l0 = 0
step = 0.05
l_max = 0.3
feature_parameter = 0.25
weights = [0.4, 0.3, 0.3]
target_vertices = 100
max_error = 0.02
[advection]
scheme = "lax_friedrichs"
time_integration = "rk2"
cfl = 0.25
[output]
every = 0.5
profiles = ["y=0", "x=-1.5"]
[metrology]
measures = ["cd", "depth"]
cd_depths = [0.5, 1.0]
cut = "x=0.5"
)";

}  // namespace

TEST_CASE("what a recipe leaves out has the documented default", "[foreign]") {
    const Recipe recipe = with({});
    CHECK(recipe.domain.boundary[0] == levelset::Side::reflective);
    CHECK(recipe.domain.length_unit == "um");
    CHECK(recipe.flux.rays == 0);
    CHECK(recipe.flux.accuracy == 0.01);
    CHECK(recipe.flux.method == "auto");
    CHECK(recipe.flux.seed == 1);
    CHECK(recipe.simplify.method == "auto");
    CHECK_FALSE(recipe.simplify.l0.has_value());
    CHECK(recipe.simplify.feature_parameter == 0.5);
    CHECK(recipe.advection.scheme == levelset::Scheme::weno3);
    CHECK(recipe.advection.time_integration == levelset::TimeIntegration::euler);
    CHECK(recipe.advection.cfl == 0.5);
    CHECK(recipe.layers.at(0).top == 0.0);
    CHECK(*target_of<double>(model_keys(recipe.steps.at(0)), "source_exponent") == 1.0);
    CHECK(domain_of(recipe).cells == std::array<int, 2>{42, 42});
}

TEST_CASE("the effective recipe parses back to an equal recipe", "[foreign]") {
    for (const std::string& text : {kBase, kRich}) {
        const Recipe recipe = parse_recipe(text, "x.toml");
        const std::string written = effective_recipe(recipe);
        INFO(written);
        CHECK(parse_recipe(written, "x.toml") == recipe);
        CHECK(effective_recipe(parse_recipe(written, "x.toml")) == written);
    }
}

TEST_CASE("recipes that differ are not equal", "[foreign]") {
    const Recipe recipe = with({});
    for (const char* setting :
         {"flux.seed=2", "step[0].sticking=0.3", "layer[0].width=3", "advection.cfl=0.4",
          "domain.boundary=periodic", "simplify.l0=0.1", "output.every=0.7"})
        CHECK_FALSE(with({setting}) == recipe);
}

TEST_CASE("every shipped recipe is valid and its effective recipe too", "[foreign]") {
    int count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(SIDEWALL_SOURCE_DIR "/configs")) {
        if (entry.path().extension() != ".toml" || entry.path().parent_path().filename() == "chemistry")
            continue;
        INFO(entry.path());
        Recipe recipe = load_recipe(entry.path());
        // The effective recipe holds the decks' keys in place of their names.
        std::erase_if(recipe.notes, [](const std::string& note) {
            return note.find(" chemistry ") != std::string::npos ||
                   note.find(".chemistry ") != std::string::npos;
        });
        CHECK(parse_recipe(effective_recipe(recipe), recipe.file) == recipe);
        ++count;
    }
    CHECK(count >= 12);
}

TEST_CASE("overrides change keys before the recipe is checked", "[foreign]") {
    CHECK(with({"step[0].duration=2"}).steps[0].duration == 2.0);
    CHECK(with({"flux.rays=1000"}).flux.rays == 1000);  // the section is not in the recipe
    CHECK(with({"domain.grid_spacing=0.5"}).domain.grid_spacing == 0.5);
    CHECK(with({"simplify.method=none"}).simplify.method == "none");
    CHECK(with({"simplify.method=lindstrom-turk"}).simplify.method == "lindstrom-turk");
    CHECK(with({"domain.extent=[6,3]"}).domain.extent == std::array<double, 2>{6.0, 3.0});
    CHECK(with({"domain.extent[0]=20"}).domain.extent == std::array<double, 2>{20.0, 10.0});
    CHECK(with({"output.profiles=[\"x=0\"]"}).output.profiles == std::vector<std::string>{"x=0"});
    CHECK(with({"metrology.cut=x=1"}).metrology.cut == "x=1");
    const Recipe sticky = with({"step[0].sticking.Si=0.4"});
    CHECK(target_of<ByMaterial>(model_keys(sticky.steps[0]), "sticking")->named.at("Si") == 0.4);
    CHECK(with({"flux.seed=2", "flux.seed=3"}).flux.seed == 3);  // the last one counts
    // An override can correct a recipe that would be refused.
    CHECK(message("flux = 1\n" + kBase).starts_with("bad.toml:1: flux = 1: must be a table"));
    CHECK_NOTHROW(parse_recipe("flux = 1\n" + kBase, "x.toml", {"flux={ rays = 1e4 }"}));
}

TEST_CASE("a wrong override is named in the message", "[foreign]") {
    const auto of = [](const std::string& setting) { return message(kBase, {setting}); };
    CHECK(of("step[0].sticking=1.4") ==
          "--set step[0].sticking=1.4: step[0].sticking = 1.4: must be in [0, 1]");
    for (const char* setting :
         {"step[1].duration=2", "step.duration=2", "flux.rays", "=3", "flux..rays=1",
          "flux.rays=", "flux.rays=[1,", "flux.rayz=10", "step[x].duration=1", "domain.extent[2]=1",
          "step[0].duration.x=1", "flux.rays=1\nflux.seed=2", "foo.bar=1"}) {
        INFO(setting);
        CHECK(of(setting).starts_with(std::string("--set ") + setting + ": "));
    }
    CHECK(
        message(kBase, {"flux.stages=all"}).find("flux.stages = \"all\": needs advection.time_integration") !=
        std::string::npos);
}

TEST_CASE("notes tell how the grid's spacing was rounded, and of beams that sides would mirror",
          "[foreign]") {
    CHECK(notes_on(parse_recipe(kBase, "base.toml", {"domain.grid_spacing=0.25"})).empty());
    const auto rounded = notes_on(parse_recipe(kBase, "base.toml", {"domain.grid_spacing=0.3"}));
    REQUIRE(rounded.size() == 1);
    CHECK(rounded[0].find("domain.grid_spacing = 0.3 is rounded to ") == 0);
    const auto of = [](const std::string& boundary) {
        return notes_on(
            parse_recipe("[domain]\nextent = [1.0, 1.0]\ngrid_spacing = 0.1\nboundary = [\"" + boundary +
                             "\", \"reflective\"]\n[[layer]]\nmaterial = \"Si\"\n[[step]]\nmodel = "
                             "\"directional\"\nduration = 1.0\ndirectional = -1.0\ndirection = [0.3, "
                             "0.0, 1.0]\n",
                         "beam.toml"));
    };
    REQUIRE(of("reflective").size() == 1);
    CHECK(of("reflective")[0].find("tilted along x") != std::string::npos);
    CHECK(of("periodic").empty());
}

TEST_CASE("notes tell how many cells a narrow shape has, whatever its side of the domain", "[foreign]") {
    const auto notes = [](const std::string& boundary, const std::string& layer) {
        return notes_on(parse_recipe("[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.1\nboundary = \"" +
                                         boundary + "\"\n[[layer]]\nmaterial = \"Si\"\n" + layer +
                                         "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n",
                                     "narrow.toml"));
    };
    const std::string trench = "shape = \"trench\"\ndepth = 1.0\n",
                      mask = "[[layer]]\nmaterial = \"Mask\"\nshape = \"mask\"\nthickness = 0.5\npolygons = ";
    CHECK(notes("reflective", trench + "width = 0.6\n").empty());
    REQUIRE(notes("reflective", trench + "width = 0.5\n").size() == 1);
    CHECK(notes("reflective", trench + "width = 0.5\n")[0].starts_with(
        "layer[0].width: the opening is 5 cells wide: "));
    // Half of the opening lies in the domain; the other half is its mirror image.
    CHECK(notes("reflective", trench + "width = 0.6\nposition = [2.0, 0.0]\n").empty());
    // A ridge of two cells with its mirror image; a ridge between two repetitions.
    CHECK(notes("reflective", trench + "width = 2.0\nposition = [-0.8, 0.0]\n")[0].find(
              "what stands beside the opening is 4 cells wide") != std::string::npos);
    CHECK(notes("periodic", trench + "width = 2.0\nposition = [-0.8, 0.0]\n").empty());
    CHECK(notes("periodic", trench + "width = 3.5\n")[0].find("beside the opening is 5 cells wide") !=
          std::string::npos);
    // Holes that merge with their repetitions along y are a slot; boxes from side to side are walls.
    CHECK(notes("periodic", "shape = \"hole\"\ndepth = 1.0\nradius = 1.7\n").empty());
    CHECK(notes("periodic", "shape = \"box\"\nheight = 1.0\nsize = [1.0, 4.0]\n").empty());
    // Outlines may touch; the width of a turned outline is measured across it.
    CHECK(notes("reflective", mask + "[{ points = [-1, -1, 0, -1, 0, 1, -1, 1] }, "
                                     "{ points = [0, -1, 1, -1, 1, 1, 0, 1] }]\n")
              .empty());
    // Each outline is too narrow alone, but wide enough with its neighbour or its mirror image.
    CHECK(notes("reflective", mask + "[{ points = [-1, -1, -0.9, -1, -0.9, 1, -1, 1] }, "
                                     "{ points = [-0.9, -1, 0, -1, 0, 1, -0.9, 1] }]\n")
              .empty());
    CHECK(notes("reflective", mask + "[{ points = [-2, -1, -1.7, -1, -1.7, 1, -2, 1] }]\n").empty());
    CHECK(notes("reflective", mask + "[{ points = [-2, -1, -1.8, -1, -1.8, 1, -2, 1] }]\n")[0].find(
              "is 4 cells wide") != std::string::npos);
    CHECK_THROWS_WITH(notes("periodic", mask + "[{ points = [-2, -1, -1.9, -1, -1.9, 1, -2, 1] }]\n"),
                      Catch::Contains("only 1 cells wide"));
    // An outline that is drawn twice, or overlaps along edges, is no narrower.
    for (const int height : {2000, 900}) {
        const test::Folder folder;
        std::ofstream(folder.path / "twice.gds", std::ios::binary) << test::gds_library(
            test::gds_cell("TOP", test::gds_boundary(1, 0, {0, 0, 1000, 0, 1000, 2000, 0, 2000}) +
                                      test::gds_boundary(1, 0, {0, 0, 1000, 0, 1000, height, 0, height})));
        CHECK(notes("reflective",
                    "[[layer]]\nmaterial = \"Mask\"\nshape = \"mask\"\nthickness = 0.5\ngds_layer = 1\n"
                    "file = \"" +
                        (folder.path / "twice.gds").string() + "\"\n")
                  .empty());
    }
    const auto turned = notes("reflective", mask + "[{ points = [0, 0, 1, 1, 0.7, 1.3, -0.3, 0.3] }]\n");
    REQUIRE(turned.size() == 1);
    CHECK(turned[0].starts_with("layer[1].polygons[0].points: the narrowest outline is 4.24 cells wide: "));
}

TEST_CASE("halves of an opening that meet across a side are one, whether it mirrors or repeats",
          "[foreign]") {
    const auto notes = [](const std::string& boundary, const std::string& width) {
        const std::string x = std::to_string(2.0 - std::stod(width));
        const std::string text =
            "[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.1\nboundary = \"" + boundary +
            "\"\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"Resist\"\nshape = \"mask\"\n"
            "thickness = 0.5\npolygons = [{points = [-2.0,-1.0,-" +
            x + ",-1.0,-" + x + ",1.0,-2.0,1.0]}, {points = [" + x + ",-1.0,2.0,-1.0,2.0,1.0," + x +
            ",1.0]}]\n[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = { Si = -0.1, Resist = 0.0 }\n";
        return parse_recipe(text, "halves.toml").notes;
    };
    CHECK(notes("periodic", "0.15") == notes("reflective", "0.15"));
    CHECK(notes("periodic", "0.25") == notes("reflective", "0.25"));
}

TEST_CASE("the top of what is cut out is checked like that of a layer", "[foreign]") {
    CHECK_THAT(message(kBase, {"layer[0].top=-1e7"}), Catch::Contains("cells from z = 0"));
    const std::string cut =
        "[domain]\nextent = [4.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\n"
        "shape = \"trench\"\nsubtract = true\nwidth = 1.0\ndepth = 1.0\ntop = -1e7\n[[step]]\n"
        "model = \"isotropic\"\nduration = 1.0\nrate = -0.1\n";
    CHECK_THAT(message(cut), Catch::Contains("cells from z = 0"));
}

TEST_CASE("keys go by their former names, too, with a note that says the new one", "[foreign]") {
    const auto beam = [](const std::string& keys) {
        return parse_recipe(
            "[domain]\nextent = [1.0, 1.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n"
            "[[step]]\nmodel = \"ion_beam\"\nduration = 1.0\nrate = 1.0\n" +
                keys,
            "beam.toml");
    };
    const Recipe now = beam("energy = 250.0\nreflect_from_deg = 60.0\n"),
                 before = beam("ion_energy = 250.0\nreflection_from = 60.0\n");
    CHECK(now.steps == before.steps);
    CHECK(notes_on(now).empty());
    const std::vector<std::string> notes = notes_on(before);
    REQUIRE(notes.size() == 2);
    CHECK(notes[0] == "step[0].ion_energy is now called energy");
    CHECK(notes[1] == "step[0].reflection_from is now called reflect_from_deg");
    CHECK_THROWS_WITH(
        beam("energy = 1.0\nion_energy = 2.0\n"),
        Catch::Contains("beam.toml:11: step[0].ion_energy = 2.0: is now called energy; drop one"));
    CHECK_THROWS_WITH(beam("ion_energy = -1.0\n"), Catch::Contains("step[0].ion_energy = -1.0: must be"));
    CHECK_THROWS_WITH(beam("\"\" = 5\n"), Catch::Contains("unknown key"));  // most keys have no former name
}

TEST_CASE("an override changes a key under either of its names, whichever the recipe uses", "[foreign]") {
    const auto energy = [](const std::string& in_recipe, const std::vector<std::string>& overrides) {
        const Recipe recipe = parse_recipe(
            "[domain]\nextent = [1.0, 1.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n"
            "[[step]]\nmodel = \"ion_beam\"\nduration = 1.0\nrate = 1.0\n" +
                in_recipe + " = 250.0\n",
            "beam.toml", overrides);
        return *target_of<double>(model_keys(recipe.steps[0]), "energy");
    };
    for (const std::string recipe : {"energy", "ion_energy"})
        for (const std::string set : {"energy", "ion_energy"})
            CHECK(energy(recipe, {"step[0]." + set + "=300"}) == 300.0);
    CHECK_THROWS_WITH(
        energy("energy", {"step[0].energy=1", "step[0].ion_energy=2"}),
        Catch::Contains("--set step[0].ion_energy=2: step[0].ion_energy = 2: is now called energy"));
}

TEST_CASE("every key that completion offers for --set is one that --set can change", "[foreign]") {
    const Recipe recipe = parse_recipe(kRich, "rich.toml");
    const std::vector<KeyDoc> keys = settable_keys(recipe);
    for (const char* name : {"domain.extent", "layer[1].thicknesses", "step[0].steps[0].steps[0].rate",
                             "step[1].species[0].source_exponent", "flux.seed", "metrology.cut"})
        CHECK(std::any_of(keys.begin(), keys.end(), [&](const KeyDoc& key) { return key.name == name; }));
    for (const KeyDoc& key : keys) {
        const std::string value = key.words.empty() ? "0.3" : key.words.back();
        const std::string answer = message(kRich, {key.name + "=" + value});
        INFO(key.name << "=" << value << ": " << answer);
        // The value 0.3 may be refused, and another model may not know the recipe's keys. The key itself is
        // known.
        const bool about_it = answer.starts_with("--set");
        for (const char* fault : {"unknown key", "the recipe has", "holds no keys"})
            CHECK_FALSE((about_it && answer.find(fault) != std::string::npos));
    }
}

TEST_CASE("an error names file, line, key, value and rule", "[foreign]") {
    const auto of = [](const std::string& from, const std::string& to) {
        std::string text = kBase;
        text.replace(text.find(from), from.size(), to);
        return message(text);
    };
    CHECK(of("default = 0.1", "default = 1.4") ==
          "bad.toml:13: step[0].sticking.default = 1.4: must be in [0, 1]");
    CHECK(of("Si = 0.2", "Sl = 0.2")
              .starts_with("bad.toml:13: step[0].sticking.Sl = 0.2: unknown material: did you mean Si?"));
    CHECK(of("duration", "duratoin").starts_with("bad.toml:11: step[0].duratoin = 5.0: unknown key"));
    CHECK(of("depth = 8.0\n", "") ==
          "bad.toml:4: layer[0].depth: missing: a trench or hole in the first layer must end somewhere");
}

TEST_CASE("a grid of several levels has whole cells on each, or is refused with a spacing that has",
          "[foreign]") {
    CHECK_FALSE(with({}).grid.levels != 1.0);
    CHECK(with({"grid.levels=2"}).grid.levels == 2.0);  // 42 x 42 cells
    CHECK_FALSE(with({"grid.levels=auto"}).grid.levels.has_value());
    CHECK(grid_levels(with({"grid.levels=auto"}), domain_of(with({}))) == 1);
    const std::vector<std::string> fine = {"grid.levels=auto", "domain.grid_spacing=0.05"};
    CHECK(grid_levels(with(fine), domain_of(with(fine))) == 3);

    const std::string refused = message(kBase, {"grid.levels=3"});
    CHECK_THAT(refused, Catch::Contains("grid.levels") && Catch::Contains("42 x 42 cells") &&
                            Catch::Contains("use at most 2 levels"));
    const std::size_t at = refused.find("grid_spacing of ");
    REQUIRE(at != std::string::npos);
    const std::string advised = refused.substr(at + 16, refused.find(' ', at + 16) - at - 16);
    CHECK(with({"grid.levels=3", "domain.grid_spacing=" + advised}).grid.levels == 3.0);

    // Sides that only a quarter of the spacing asked for divides into coarsest cells.
    for (const std::string extent : {"[6.5, 6.4]", "[6.3, 6.4]", "[7.3, 4.1]", "[10, 3.7]", "[6.4, 3.5]"}) {
        INFO(extent);
        const std::vector<std::string> wafer{"grid.levels=3", "layer=[{material=\"Si\"}]",
                                             "domain.extent=" + extent, "domain.grid_spacing=0.1"};
        CHECK_THAT(message(kBase, wafer), Catch::Contains("grid_spacing of 0.025 would do"));
        std::vector<std::string> advice = wafer;
        advice.back() = "domain.grid_spacing=0.025";
        CHECK(with(advice).grid.levels == 3.0);
    }

    CHECK_THAT(message(kBase, {"grid.levels=2.5"}), Catch::Contains("must be 1, 2, 3 or \"auto\""));
    CHECK_THAT(message(kBase, {"grid.levels=4"}), Catch::Contains("grid.levels"));
    CHECK_THAT(message(kBase, {"grid.levels=3", "domain.grid_spacing=1.0"}), Catch::Contains("grid.levels"));
    CHECK_THAT(message(kBase, {"domain.extent=[10.0]", "grid.levels=2"}), Catch::Contains("profile"));
    CHECK(with({"domain.extent=[10.0]", "grid.levels=1"}).grid.levels == 1.0);
}

TEST_CASE("layers stand on each other and stacks expand bottom up", "[foreign]") {
    const Recipe recipe = parse_recipe(kRich, "x.toml");
    const std::vector<MaterialLayer> layers = expanded_layers(recipe);
    REQUIRE(layers.size() == 1 + 8 + 3);
    CHECK(layers[0].shape.top == 0.0);
    for (int period = 0; period < 4; ++period) {
        const auto i = static_cast<std::size_t>(1 + 2 * period);
        CHECK(layers[i].material == *material_id(recipe.materials, "SiO2"));
        CHECK(layers[i + 1].material == *material_id(recipe.materials, "Si3N4"));
        CHECK(layers[i].shape.top == Approx(0.3 * period + 0.2));
        CHECK(layers[i + 1].shape.top == Approx(0.3 * (period + 1)));
    }
    CHECK(layers[9].shape.top == Approx(1.7));                                // 1.2 of the stack and 0.5
    CHECK(layers[9].shape.depth == std::numeric_limits<double>::infinity());  // through the layer
    CHECK(layers[10].shape.top == Approx(1.7));  // a fin stands on the layers below
    CHECK(layers[11].shape.top == 2.0);
    CHECK(layers[9].material ==
          static_cast<int>(default_materials().size()));  // a new material comes after the built-in
    CHECK(recipe.materials.size() == default_materials().size() + 1);
}

TEST_CASE("loops nest twelve deep, and deeper ones are refused with their place", "[foreign]") {
    const auto nested = [](int loops, const std::string& step) {
        std::string list = "[{ " + step + " }]";
        for (int k = 0; k < loops; ++k) list = "[{ steps = " + list + " }]";
        return "step = " + list +
               "\n[domain]\nextent = [1.0, 1.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n";
    };
    const std::string etch = "model = \"isotropic\", duration = 1.0, rate = -1.0";
    const std::string polish = "model = \"planarize\", height = -0.5";
    CHECK(expanded_steps(parse_recipe(nested(12, etch), "deep.toml")).size() == 1);
    for (const std::string& step : {etch, polish, etch + ", stop = \"depth > 1.0\"",
                                    std::string("model = \"cut\", shape = \"hole\", radius = 0.2")})
        for (const int loops : {13, 15, 16, 17, 40})
            CHECK_THROWS_WITH(parse_recipe(nested(loops, step), "deep.toml"),
                              Catch::StartsWith("deep.toml:1: step[0].steps[0].steps[0].") &&
                                  Catch::Contains(": lies in 12 loops: they nest no deeper"));
    CHECK_THROWS_WITH(parse_recipe(nested(12, "model = \"isotropic\", duration = 1.0"), "deep.toml"),
                      Catch::Contains(".rate: missing"));
}

TEST_CASE("loops unroll in the order they run", "[foreign]") {
    const std::vector<Step> steps = expanded_steps(parse_recipe(kRich, "x.toml"));
    REQUIRE(steps.size() == 3 * (2 + 1) + 2);
    CHECK(steps[0].name == "1.1.1 isotropic (cycle 1 of 3, cycle 1 of 2)");
    CHECK(steps[1].name == "1.1.1 isotropic (cycle 1 of 3, cycle 2 of 2)");
    CHECK(steps[2].name == "1.2 directional (cycle 1 of 3)");
    CHECK(steps[8].name == "1.2 directional (cycle 3 of 3)");
    CHECK(steps[10].name == "2 multi_particle (cycle 2 of 2)");
    for (const Step& step : steps) CHECK((step.repeat == 1 && step.steps.empty()));
}

TEST_CASE("every key that a section reads is documented, with a default or as required", "[foreign]") {
    for (const SectionDoc& section : recipe_documentation()) {
        INFO(section.name);
        CHECK_FALSE(section.keys.empty());
        for (const KeyDoc& key : section.keys) {
            INFO(key.name);
            CHECK_FALSE(key.type.empty());
            CHECK((key.name == "shape" || !key.doc.empty()));
        }
    }
}

TEST_CASE("the nearest name is the one with the fewest edits", "[foreign]") {
    const std::vector<std::string> names = {"sticking", "rate", "duration"};
    CHECK(did_you_mean("", "stiking", names) == "did you mean sticking?");
    CHECK(did_you_mean("; ", "Rate", names) == "; did you mean rate?");
    CHECK(did_you_mean("; ", "", names, ".") == ".");
    CHECK(did_you_mean("; ", "pressure", names, ".") == ".");
}
