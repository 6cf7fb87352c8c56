#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "tests/integration/run_program.hpp"

// Mistakes of users, one row each. The program must name the place, the fault and the remedy, return the exit
// code of the cause, and leave nothing behind that looks like a result.
namespace {

namespace fs = std::filesystem;

const std::string kDomain = "[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.1\n";           // lines 1 to 3
const std::string kLayer = "[[layer]]\nmaterial = \"Si\"\n";                                 // lines 4 and 5
const std::string kStep = "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n";  // lines 6 to 9
const std::string kGood = kDomain + kLayer + kStep;

using sidewall::test::Folder;
using sidewall::test::Outcome;

Outcome run(const fs::path& folder, const std::string& arguments) {
    return sidewall::test::run_program(folder, arguments);
}

std::set<std::string> contents(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) names.insert(entry.path().string());
    return names;
}

struct Row {
    std::string what;
    std::string file;       ///< name of the input file, empty for none
    std::string text;       ///< its content
    std::string arguments;  ///< arguments of the program, in shell syntax
    int exit_code;
    std::vector<std::string> message;  ///< parts that the output must contain
};

void check_rows(const std::vector<Row>& rows) {
    for (const Row& row : rows) {
        const Folder folder;
        if (!row.file.empty()) std::ofstream(folder.path / row.file, std::ios::binary) << row.text;
        const std::set<std::string> before = contents(folder.path);
        const Outcome outcome = run(folder.path, row.arguments);
        INFO(row.what << "\nsidewall " << row.arguments << "\n" << outcome.output);
        CHECK(outcome.exit_code == row.exit_code);
        for (const std::string& piece : row.message) {
            INFO("expected: " << piece);
            CHECK(outcome.output.find(piece) != std::string::npos);
        }
        CHECK(contents(folder.path) == before);
    }
}

// A recipe that is wrong at one place: `bad.toml:LINE: KEY...` and what to do.
Row recipe(const std::string& what, const std::string& text, const std::string& place,
           const std::string& remedy) {
    return {what, "bad.toml", text, "check bad.toml", 2, {"sidewall: bad.toml:" + place, remedy}};
}

Row override_row(const std::string& setting, const std::string& rest, const std::string& remedy) {
    return {"override", "good.toml",
            kGood,      "check good.toml --set '" + setting + "'",
            2,          {"sidewall: --set " + setting + ": " + rest, remedy}};
}

std::string step(const std::string& lines) {
    return kDomain + kLayer + "[[step]]\n" + lines;  // `lines` start at line 7
}

std::string layer(const std::string& lines) {
    return kDomain + "[[layer]]\n" + lines + kStep;  // `lines` start at line 5
}

}  // namespace

TEST_CASE("the recipe that the bad ones are made from is good", "[foreign]") {
    const Folder folder;
    std::ofstream(folder.path / "good.toml") << kGood;
    const Outcome outcome = run(folder.path, "check good.toml");
    INFO(outcome.output);
    CHECK(outcome.exit_code == 0);
    CHECK(contents(folder.path).size() == 1);
}

TEST_CASE("a bad recipe is refused with file, line, key and remedy", "[foreign][slow]") {
    const std::string fins = "material = \"Si\"\nshape = \"fin\"\n";
    check_rows({
        recipe("syntax", kDomain + "[[layer]\n", "4: ", "not valid TOML"),
        recipe("duplicate key", kDomain + "grid_spacing = 0.2\n", "4: ", "cannot redefine"),
        recipe("duplicate section", kGood + "[domain]\n", "10: ", "not valid TOML"),
        recipe("header without a name", kGood + "[.flux]\n", "10: ", "not valid TOML"),
        recipe("not text", std::string("extent = \"\xff\xfe\"\n"), "1: ", "utf-8"),
        recipe("binary",
               std::string("\x7f"
                           "ELF\0\0\0",
                           7),
               "1: ", "not valid TOML"),
        recipe("deep nesting", "a = " + std::string(5000, '[') + "\n", "1: ", "not valid TOML"),
        recipe("empty file", "", "1: domain: ", "add [domain]"),
        recipe("unknown section", kGood + "[simplfy]\n", "10: simplfy = ", "did you mean simplify?"),
        recipe("section as a value", "flux = 3\n" + kGood, "1: flux = 3: ", "write [flux]"),
        recipe("section as a list", kGood + "[[flux]]\n", "10: flux = ", "write [flux]"),

        recipe("no extent", "[domain]\ngrid_spacing = 1\n" + kLayer + kStep, "1: domain.extent: ", "missing"),
        recipe("extent of none", "[domain]\nextent = []\n", "2: domain.extent = ", "list of 2 numbers"),
        recipe("extent of three", "[domain]\nextent = [1, 1, 1]\n",
               "2: domain.extent = ", "list of 2 numbers"),
        recipe("extent of a line 0", "[domain]\nextent = [0]\ngrid_spacing = 0.1\n",
               "2: domain.extent[0] = 0: ", "greater than 0"),
        recipe("extent 0", "[domain]\nextent = [0, 1]\ngrid_spacing = 0.1\n",
               "2: domain.extent[0] = 0: ", "greater than 0"),
        recipe("spacing NaN", "[domain]\nextent = [1, 1]\ngrid_spacing = nan\n",
               "3: domain.grid_spacing = nan: ", "finite"),
        recipe("spacing infinite", "[domain]\nextent = [1, 1]\ngrid_spacing = inf\n",
               "3: domain.grid_spacing = inf: ", "finite"),
        recipe("spacing negative", "[domain]\nextent = [1, 1]\ngrid_spacing = -0.1\n",
               "3: domain.grid_spacing = -0.1: ", "greater than 0"),
        recipe("spacing as text", "[domain]\nextent = [1, 1]\ngrid_spacing = \"fine\"\n",
               "3: domain.grid_spacing = \"fine\": ", "must be a number"),
        recipe("spacing too fine", "[domain]\nextent = [1, 1]\ngrid_spacing = 1e-9\n" + kLayer + kStep,
               "3: domain.grid_spacing = 1e-09: ", "use a larger spacing"),
        recipe("extents without a common spacing",
               "[domain]\nextent = [1.0, 1.23456789]\ngrid_spacing = 0.1\n" + kLayer + kStep,
               "3: domain.extent = ", "whole number of cells"),
        recipe("extent huge", "[domain]\nextent = [1e300, 1]\ngrid_spacing = 0.1\n",
               "2: domain.extent[0] = 1e+300: ", "must be in (0, 1e+09]; check the unit"),
        recipe("boundary word", kDomain + "boundary = [\"periodc\", \"reflective\"]\n" + kLayer + kStep,
               "4: domain.boundary[0] = \"periodc\": ", "did you mean periodic?"),
        recipe("length unit", kDomain + "length_unit = \"inch\"\n",
               "4: domain.length_unit = \"inch\": ", "one of nm, um"),

        recipe("no layer", kDomain + kStep, "1: layer: missing", "add a [[layer]]"),
        recipe("layer as a table", kDomain + "[layer]\nmaterial = \"Si\"\n",
               "4: layer = ", "write [[layer]]"),
        recipe("empty layer", layer(""), "4: layer[0].material: ", "missing"),
        recipe("unknown material", layer("material = \"SiO\"\n"),
               "5: layer[0].material = \"SiO\": ", "did you mean Si"),
        recipe("unknown shape", layer("shape = \"trensh\"\n"),
               "5: layer[0].shape = \"trensh\": ", "did you mean trench?"),
        recipe("floating mask", layer("material = \"Si\"\nshape = \"mask\"\n"),
               "6: layer[0].shape = \"mask\": ", "stands on a substrate"),
        recipe("mask without polygons",
               layer("material = \"Si\"\n[[layer]]\nmaterial = \"Mask\"\nshape = \"mask\"\nthickness = 1\n"),
               "6: layer[1].polygons: ", "or the file of a layout"),
        recipe("two corners",
               layer("material = \"Si\"\n[[layer]]\nmaterial = \"Mask\"\nshape = \"mask\"\nthickness = 1\n"
                     "polygons = [{ points = [0, 0, 1, 1] }]\n"),
               "10: layer[1].polygons[0].points = ", "at least three corners"),
        recipe("bottomless trench", layer("material = \"Si\"\nshape = \"trench\"\nwidth = 1\n"),
               "4: layer[0].depth: ", "missing"),
        recipe("key of another shape", layer("material = \"Si\"\nradius = 1\n"),
               "6: layer[0].radius = 1: ", "unknown key of a plane"),
        recipe("width 0", layer(fins + "width = 0\nheight = 1\n"),
               "7: layer[0].width = 0: ", "greater than 0"),
        recipe("taper", layer(fins + "width = 1\nheight = 1\ntaper_deg = 90\n"),
               "9: layer[0].taper_deg = 90: ", "in [-80, 80]"),
        recipe("height out of the grid", layer(fins + "width = 1\nheight = 1e6\n"),
               "8: layer[0].height = ", "check the unit"),
        recipe("second layer without height", kDomain + kLayer + kLayer + kStep,
               "6: layer[1].thickness: ", "give the layer's thickness"),
        recipe("stack of unequal lists",
               kDomain + kLayer +
                   "[[layer]]\nshape = \"stack\"\nmaterials = [\"W\", \"TiN\"]\nthicknesses = [1]\n",
               "9: layer[1].thicknesses = ", "as many as materials"),
        recipe("stack without a substrate",
               kDomain + "[[layer]]\nshape = \"stack\"\nmaterials = [\"W\"]\nthicknesses = [1]\n",
               "5: layer[0].shape = \"stack\": ", "plane layer before it"),
        recipe("mesh file missing", layer("material = \"Si\"\nshape = \"mesh\"\nfile = \"none.vtp\"\n"),
               "7: layer[0].file = \"none.vtp\": ", "relative to the recipe"),
        recipe("material twice", "[[material]]\nname = \"A\"\n[[material]]\nname = \"A\"\n" + kGood,
               "4: material[1].name = \"A\": ", "drop one"),
        recipe("colour", "[[material]]\nname = \"A\"\ncolour = \"red\"\n" + kGood,
               "3: material[0].colour = \"red\": ", "must look like"),

        recipe("no step", kDomain + kLayer, "1: step: missing", "add a [[step]]"),
        recipe("no model", step("duration = 1\n"), "6: step[0].model: ", "sidewall models"),
        recipe("unknown model", step("model = \"isotropc\"\n"),
               "7: step[0].model = \"isotropc\": ", "did you mean isotropic?"),
        recipe("no duration", step("model = \"isotropic\"\nrate = -1\n"), "6: step[0].duration: ", "missing"),
        recipe("duration negative", step("model = \"isotropic\"\nrate = -1\nduration = -1\n"),
               "9: step[0].duration = -1: ", "greater than 0"),
        recipe("no rate", step("model = \"isotropic\"\nduration = 1\n"), "6: step[0].rate: ", "missing"),
        recipe("growth without a film", step("model = \"isotropic\"\nrate = 1\nduration = 1\n"),
               "6: step[0].deposit: ", "name it"),
        recipe("film without growth", kGood + "deposit = \"SiO2\"\n",
               "10: step[0].deposit = \"SiO2\": ", "drop deposit"),
        recipe("sticking above 1",
               step("model = \"single_particle\"\nduration = 1\nrate = -1\nsticking = 1.4\n"),
               "10: step[0].sticking = 1.4: ", "must be in [0, 1]"),
        recipe("sticking by unknown material",
               step("model = \"single_particle\"\nduration = 1\nrate = -1\nsticking = { Mask = 0, Sillicon = "
                    "0.1 }\n"),
               "10: step[0].sticking.Sillicon = 0.1: ", "[[material]]"),
        recipe("misspelt key", kGood + "stiking = 0.1\nrepaet = 2\n",
               "11: step[0].repaet = 2: ", "did you mean repeat?"),
        recipe("step whose name would clear the terminal", kGood + "name = \"\\u001b[2Jx\\r\"\n",
               "10: step[0].name = \"\\u001b[2Jx\\u000d\": ", "control character"),
        recipe("material whose name has a line break",
               kGood + "[[material]]\nname = \"a\\nb\"\ndensity = 1\n",
               "11: material[0].name = ", "line break"),
        recipe("step whose name holds a C1 control character", kGood + "name = \"a\\u009b2J\"\n",
               "10: step[0].name = ", "control character"),
        recipe("no species", step("model = \"multi_particle\"\nduration = 1\nspecies = []\n"),
               "9: step[0].species = ", "must not be empty"),
        recipe("species without a rate",
               step("model = \"multi_particle\"\nduration = 1\nspecies = [{ name = \"a\" }]\n"),
               "9: step[0].species[0].rate: ", "missing"),
        recipe("beam from below",
               step("model = \"directional\"\nduration = 1\ndirectional = -1\ndirection = [0, 0, -1]\n"),
               "10: step[0].direction = ", "towards the source"),
        recipe("model and steps", kGood + "[[step.steps]]\nmodel = \"isotropic\"\n",
               "10: step[0].steps = ", "drop one"),
        recipe("empty loop", step("repeat = 3\nsteps = []\n"), "8: step[0].steps = ", "[[step.steps]]"),
        recipe("loops without end",
               step("repeat = 100000\n[[step.steps]]\nmodel = \"isotropic\"\nduration = 1\nrate = -1\nrepeat "
                    "= 100000\n"),
               "6: step: ", "repeat fewer times"),
        recipe("repeat by half", kGood + "repeat = 1.5\n", "10: step[0].repeat = 1.5: ", "whole number"),

        recipe("few rays", kGood + "[flux]\nrays = 50\n", "11: flux.rays = 50: ", "in [100, 1e+12]"),
        recipe("too many rays", kGood + "[flux]\nrays = 1e15\n", "11: flux.rays = ", "in [0, 1e+12]"),
        recipe("relative error", kGood + "[flux]\nrelative_error = 0.0\n", "11: flux.relative_error = 0",
               "must be in (0, 0.5]"),
        recipe("few batches", kGood + "[flux]\nbatches = 8\n", "11: flux.batches = 8: ", "in [16"),
        recipe("seed negative", kGood + "[flux]\nseed = -1\n", "11: flux.seed = -1: ", "in [0"),
        recipe("method", kGood + "[simplify]\nmethod = \"lindstrom_turk\"\n",
               "11: simplify.method = \"lindstrom_turk\": ", "did you mean lindstrom-turk?"),
        recipe("l0 word", kGood + "[simplify]\nl0 = \"automatic\"\n",
               "11: simplify.l0 = \"automatic\": ", "or \"auto\""),
        recipe("l_max below l0", kGood + "[simplify]\nl0 = 2\nl_max = 1\n",
               "12: simplify.l_max = 1: ", "at least l0"),
        recipe("weights all 0", kGood + "[simplify]\nweights = [0, 0, 0]\n",
               "11: simplify.weights = ", "not all be 0"),
        recipe("two weights", kGood + "[simplify]\nweights = [1, 1]\n",
               "11: simplify.weights = ", "list of 3 numbers"),
        recipe("cfl", kGood + "[advection]\ncfl = 1.5\n", "11: advection.cfl = 1.5: ", "in [0.001, 0.5]"),
        recipe("scheme", kGood + "[advection]\nscheme = \"weno\"\n",
               "11: advection.scheme = \"weno\": ", "did you mean weno"),
        recipe("output every 0", kGood + "[output]\nevery = 0\n", "11: output.every = 0: ", "greater than 0"),
        recipe("output every instant", kGood + "[output]\nevery = 1e-8\n",
               "11: output.every = 1e-08: ", "use a longer time"),
        recipe("profile text", kGood + "[output]\nprofiles = [\"y=0\", \"y\"]\n",
               "11: output.profiles[1] = \"y\": ", "must be a plane"),
        recipe("profile outside", kGood + "[output]\nprofiles = [\"y=3\"]\n",
               "11: output.profiles[0] = \"y=3\": ", "outside the domain"),
        recipe("CD nowhere", kGood + "[metrology]\nmeasures = [\"cd\"]\n",
               "10: metrology.cd_depths: ", "missing"),
    });
}

TEST_CASE("a recipe whose shapes make no sense is refused with file, line, key and remedy", "[foreign]") {
    // The shape's own keys start at line 7; the domain has 40 x 40 cells.
    const auto shape = [](const std::string& name, const std::string& lines) {
        return layer("material = \"Si\"\nshape = \"" + name + "\"\n" + lines);
    };
    const auto mask = [](const std::string& polygons) {
        return layer(
            "material = \"Si\"\n[[layer]]\nmaterial = \"Mask\"\nshape = \"mask\"\nthickness = 1\n"
            "polygons = [" +
            polygons + "]\n");  // line 10
    };
    const std::string square = "{ points = [-1, -1, 1, -1, 1, 1, -1, 1] }";
    check_rows({
        recipe("2 x 1 cells", "[domain]\nextent = [1.0, 0.5]\ngrid_spacing = 0.5\n" + kLayer + kStep,
               "3: domain.grid_spacing = 0.5: ", "use a spacing of 0.125 or less"),
        recipe("trench wider than the domain", shape("trench", "width = 5\ndepth = 1\n"),
               "7: layer[0].width = 5: ", "use a smaller one or a larger domain.extent"),
        recipe("trench as wide as the domain", shape("trench", "width = 4\ndepth = 1\n"),
               "7: layer[0].width = 4: ", "covers the whole domain"),
        recipe("hole around the domain", shape("hole", "radius = 2.9\ndepth = 1\n"),
               "7: layer[0].radius = 2.9: ", "covers the whole domain"),
        recipe("fin wider than the domain", shape("fin", "width = 5\nheight = 1\n"),
               "7: layer[0].width = 5: ", "covers the whole domain"),
        recipe("box wider than the domain", shape("box", "size = [4, 5]\nheight = 1\n"),
               "7: layer[0].size = ", "covers the whole domain"),
        recipe("trench outside", shape("trench", "width = 1\ndepth = 1\nposition = [2.5, 0]\n"),
               "9: layer[0].position = ", "move it inside"),
        recipe("walls that meet", shape("trench", "width = 1\ndepth = 4\ntaper_deg = 10\n"),
               "9: layer[0].taper_deg = 10: ", "taper of at most 7.125 degrees, or a depth of at most 2.836"),
        recipe("walls that meet in a mask",
               layer("material = \"Si\"\n[[layer]]\nmaterial = \"Mask\"\nshape = \"hole\"\nradius = 0.5\n"
                     "thickness = 1\ntaper_deg = 30\n"),
               "11: layer[1].taper_deg = 30: ", "before the 1 asked for"),
        recipe("a fin that ends early", shape("fin", "width = 1\nheight = 4\ntaper_deg = 10\n"),
               "9: layer[0].taper_deg = 10: ", "height of at most 2.836"),
        recipe("walls that lean out of the domain",
               shape("trench", "width = 1\ndepth = 2\ntaper_deg = -45\n"),
               "9: layer[0].taper_deg = -45: ", "use a smaller taper"),
        recipe("trench of 1.5 cells", shape("trench", "width = 0.15\ndepth = 1\n"),
               "7: layer[0].width = 0.15: the opening is 1.5 cells wide",
               "use a grid_spacing of 0.025 or less"),
        recipe("hole of 1.6 cells", shape("hole", "radius = 0.08\ndepth = 1\n"),
               "7: layer[0].radius = 0.08: the opening is 1.6 cells wide", "use a grid_spacing"),
        recipe("box of 1 cell", shape("box", "size = [1, 0.1]\nheight = 1\n"),
               "7: layer[0].size = ", "the shape is 1 cells wide"),
        recipe("ridge of 1 cell", shape("trench", "width = 3.9\ndepth = 1\n"),
               "7: layer[0].width = 3.9: what stands beside the opening is 1 cells wide",
               "use a grid_spacing"),
        recipe("bow tie", mask("{ points = [-1, -1, 1, 1, 1, -1, -1, 1] }"),
               "10: layer[1].polygons[0].points = ", "crosses itself"),
        recipe("crossing outlines", mask(square + ", { points = [0, 0, 1.5, 0, 1.5, 1.5, 0, 1.5] }"),
               "10: layer[1].polygons[1].points = ", "overlaps polygons[0]"),
        recipe("nested outlines",
               mask(square + ", { points = [-0.5, -0.5, 0.5, -0.5, 0.5, 0.5, -0.5, 0.5] }"),
               "10: layer[1].polygons[1].points = ", "lies inside polygons[0]"),
        recipe("nested outlines, the inner first", mask("{ points = [0, 0, 0.5, 0, 0, 0.5] }, " + square),
               "10: layer[1].polygons[1].points = ", "encloses polygons[0]"),
        recipe("the same outline twice", mask(square + ", " + square),
               "10: layer[1].polygons[1].points = ", "a ring as one with a slit"),
        recipe("outlines that share a part of their edges",
               mask(square + ", { points = [0.5, -1, 1.5, -1, 1.5, 1, 0.5, 1] }"),
               "10: layer[1].polygons[1].points = ", "overlaps polygons[0]"),
        recipe("two different corners", mask("{ points = [0, 0, 1, 1, 1, 1, 0, 0] }"),
               "10: layer[1].polygons[0].points = ", "three different corners"),
        recipe("corners on a line", mask("{ points = [-0.8, -0.5, 0, -0.5, 0.8, -0.5] }"),
               "10: layer[1].polygons[0].points = [-0.8, -0.5, 0, -0.5, 0.8, -0.5]: ", "has no area"),
        recipe("outline of 1 cell", mask("{ points = [-1, 0, 1, 0, 1, 0.1, -1, 0.1] }"),
               "10: layer[1].polygons[0].points = ", "only 1 cells wide"),
        recipe("outline around the domain", mask("{ points = [-3, -3, 3, -3, 3, 3, -3, 3] }"),
               "10: layer[1].polygons = ", "check unit and position"),
        recipe("outline outside the domain", mask("{ points = [3, 3, 4, 3, 4, 4, 3, 4] }"),
               "10: layer[1].polygons = ", "all open or all closed"),
    });
}

TEST_CASE("a recipe whose numbers make no sense is refused with file, line, key and remedy", "[foreign]") {
    const std::string polish = "[[step]]\nmodel = \"planarize\"\n";
    check_rows({
        recipe("one ray", kGood + "[flux]\nrays = 1\n", "11: flux.rays = 1: ", "in [100, 1e+12]"),
        recipe("one ray at most", kGood + "[flux]\nrelative_error = 0.1\nmax_rays = 1\n",
               "12: flux.max_rays = 1: ", "in [100, 1e+12]"),
        recipe("more batches than rays", kGood + "[flux]\nrays = 1000\nbatches = 5000\n",
               "12: flux.batches = 5000: ", "at most rays = 1000"),
        recipe("cfl", kGood + "[advection]\ncfl = 1e-9\n", "11: advection.cfl = 1e-09: ", "in [0.001, 0.5]"),
        recipe("polish below the wafer", kDomain + kLayer + polish + "height = -1\n" + kStep,
               "8: step[0].height = -1: lies below the whole wafer", "polish above"),
        recipe("polish far away", kGood + polish + "height = 1e5\n", "12: step[1].height = 100000",
               "check the unit"),
        recipe("a coat beyond all measure",
               kGood + "[[step]]\nmodel = \"conformal\"\nmaterial = \"W\"\nthickness = 1e5\n",
               "13: step[1].thickness = 100000", "check the unit"),
        // Faults that show only in the first time step.
        recipe("polish below all that was etched", kGood + polish + "height = -1\n",
               " step 2 planarize: height = -1: lies below the whole wafer", "polish above"),
        recipe("a step without end", step("model = \"isotropic\"\nduration = 1.0\nrate = -1e7\n"),
               " step 1 isotropic: the surface moves at 1e+07 um/s", "check its rates and duration"),
        recipe("too much for any machine",
               "[domain]\nextent = [1000, 1000]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\nshape = "
               "\"trench\"\nwidth = 100.0\ndepth = 1900.0\n" +
                   kStep,
               " domain.grid_spacing = 0.1: the run would need about ", "use a spacing of"),
    });
    SECTION("a run refuses what only a time step tells, too") {
        const Folder folder;
        std::ofstream(folder.path / "late.toml") << kGood + polish + "height = -1\n";
        const Outcome outcome = run(folder.path, "run late.toml -o out");
        INFO(outcome.output);
        CHECK(outcome.exit_code == 2);
        CHECK(outcome.output.find("late.toml: step 2 planarize: height = -1: lies below") !=
              std::string::npos);
    }
}

TEST_CASE("a gas, a target or a plasma that makes no sense is refused with file, line, key and remedy",
          "[foreign]") {
    const auto neutral = [](const std::string& keys) {
        return step("model = \"single_particle\"\nduration = 1.0\nrate = -1.0\n" + keys);  // line 10
    };
    const auto species = [](const std::string& keys) {
        return step("model = \"multi_particle\"\nduration = 1.0\nspecies = [{ name = \"a\", rate = -1.0, " +
                    keys + " }]\n");  // line 9
    };
    const auto plasma = [](const std::string& keys) {
        return step("model = \"cf4_o2\"\nduration = 1.0\n" + keys);  // line 9
    };
    check_rows({
        recipe("no free path", neutral("mean_free_path = 0\n"),
               "10: step[0].mean_free_path = 0: ", "greater than 0"),
        recipe("a path that is no number", neutral("mean_free_path = nan\n"),
               "10: step[0].mean_free_path = nan: ", "finite"),
        recipe("a path of words", neutral("mean_free_path = \"short\"\n"),
               "10: step[0].mean_free_path = \"short\": ", "none"),
        recipe("a path far below the grid", neutral("mean_free_path = 1e-3\n"),
               "10: step[0].mean_free_path = 0.001: ", "raise it"),
        recipe("a pressure below 0", neutral("pressure = -5\n"),
               "10: step[0].pressure = -5: ", "in (0, 1e+07]"),
        recipe("the pressure of a liquid", neutral("pressure = 5e6\n"),
               "10: step[0].pressure = 5000000.0: ", "lower it"),
        recipe("path and pressure", neutral("mean_free_path = 1.0\npressure = 1.0\n"),
               "11: step[0].pressure = 1.0: ", "drop one of the two"),
        recipe("temperature alone", neutral("temperature = 300\n"),
               "10: step[0].temperature = 300: ", "pressure"),
        recipe("a molecule of nothing", neutral("pressure = 1.0\nmolecule_diameter = 0\n"),
               "11: step[0].molecule_diameter = 0: ", "in [0.01, 10]"),
        recipe("ions in a gas", species("kind = \"ion\", pressure = 1.0"),
               "9: step[0].species[0].pressure = 1.0: ", "is for neutrals"),
        recipe("a target that sends less than nothing", species("source_beta = -1.5"),
               "9: step[0].species[0].source_beta = -1.5: ", "in [-1, 1e+06]"),
        recipe("a target of ions", species("kind = \"ion\", source_beta = 1.0"),
               "9: step[0].species[0].source_beta = 1.0: ", "is for neutrals"),
        recipe("a target and a power", species("source_beta = 1.0, source_exponent = 2.0"),
               "9: step[0].species[0].source_exponent = 2.0: ", "drop one of the two"),
        recipe("a source's file that is not there", species("source_file = \"none.csv\""),
               "9: step[0].species[0].source_file = ", "no such file"),
        recipe("too much germanium", plasma("germanium = { SiGe = 1.5 }\n"),
               "9: step[0].germanium.SiGe = 1.5: ", "in [0, 1]"),
        recipe("sticking above 1", plasma("oxygen_sticking = 2.0\n"),
               "9: step[0].oxygen_sticking = 2.0: ", "in [0, 1]"),
        recipe("a flux below 0", plasma("etchant_flux = -1.0\n"),
               "9: step[0].etchant_flux = -1.0: ", "at least 0"),
        recipe("an unknown material", plasma("etched = [\"SiGr\"]\n"), "9: step[0].etched", "did you mean"),
        recipe("a key of another model", plasma("sulfur_flux = 1.0\n"),
               "9: step[0].sulfur_flux = 1.0: ", "unknown"),
        recipe(
            "a growth rate below 0",
            step("model = \"epitaxy\"\nduration = 1.0\nmaterial = \"Si\"\ndeposit = \"SiGe\"\nr111 = -1.0\n"),
            "11: step[0].r111 = -1.0: ", "at least 0"),
    });
}

TEST_CASE("a layer's file that is no mesh or layout is found by check", "[foreign]") {
    for (const std::string file : {"bad.ply", "bad.vtp", "bad.stl", "bad.obj", "bad.gds", "bad.doc"}) {
        const Folder folder;
        std::ofstream(folder.path / file) << "hello";
        const std::string shape = file == "bad.gds" ? "mask" : "mesh";
        std::ofstream(folder.path / "bad.toml")
            << kDomain + kLayer + "[[layer]]\nmaterial = \"W\"\nshape = \"" + shape + "\"\nfile = \"" + file +
                   "\"\n" + (shape == "mask" ? "thickness = 1.0\n" : "") + kStep;
        for (const std::string command : {"check bad.toml --no-estimate", "run bad.toml -o out"}) {
            const Outcome outcome = run(folder.path, command);
            INFO(outcome.output);
            CHECK(outcome.exit_code == 3);
            CHECK(outcome.output.find("sidewall: bad.toml:9: layer[1].file: ") == 0);
            CHECK(outcome.output.find(file) != std::string::npos);
            CHECK(contents(folder.path).size() == 2);
        }
    }
    const Folder folder;  // a good mesh, but in nanometres
    std::ofstream(folder.path / "far.stl")
        << "solid a\nfacet normal 0 0 1\nouter loop\nvertex 100 100 0\n"
           "vertex 900 100 0\nvertex 100 900 0\nendloop\nendfacet\nendsolid\n";
    std::ofstream(folder.path / "small.stl")  // open, and smaller than the domain
        << "solid a\nfacet normal 0 0 1\nouter loop\nvertex -1 -1 0\n"
           "vertex 1 -1 0\nvertex -1 1 0\nendloop\nendfacet\nendsolid\n";
    for (const auto& [file, message] :
         {std::pair{"far", "the mesh lies from x = 100 to 900"},
          {"small",
           "the mesh is not closed: around (-0.333333, -0.333333, 0) it has an opening, 1 of its area"}}) {
        std::ofstream(folder.path / "bad.toml")
            << kDomain + kLayer + "[[layer]]\nmaterial = \"W\"\nshape = \"mesh\"\nfile = \"" + file +
                   ".stl\"\n" + kStep;
        const Outcome outcome = run(folder.path, "check bad.toml");
        INFO(outcome.output);
        CHECK(outcome.exit_code == 2);
        CHECK(outcome.output.find(std::string("bad.toml:9: layer[1].file = \"") + file +
                                  ".stl\": " + message) != std::string::npos);
    }
}

TEST_CASE("a bad override is refused by name", "[foreign]") {
    check_rows({
        override_row("step[0].duration=-1", "step[0].duration = -1: ", "greater than 0"),
        override_row("step[1].duration=1", "step[1]: ", "counted from 0"),
        override_row("simplfy.method=none", "simplfy = ", "did you mean simplify?"),
        override_row("flux.rays=[1,", "not a TOML value", "TOML"),
        override_row("flux.rays", "must be key=value", "flux.rays=1000"),
        override_row("domain.grid_spacing=1e-12", "domain.grid_spacing = 1e-12: ", "use a larger spacing"),
    });
}

TEST_CASE("a bad command line is a usage error", "[foreign]") {
    check_rows({
        {"no command", "", "", "", 2, {"subcommand"}},
        {"unknown command", "", "", "chekc x.toml", 2, {"subcommand chekc", "did you mean check?"}},
        {"no recipe", "", "", "check", 2, {"RECIPE"}},
        {"unknown option", "good.toml", kGood, "check good.toml --fast", 2, {"--fast"}},
        {"option without value", "good.toml", kGood, "check good.toml --set", 2, {"--set"}},
        {"threads", "good.toml", kGood, "check good.toml --threads 0", 2, {"--threads"}},
        {"number that is none", "", "", "study --rays nan", 2, {"--rays: nan: must be a number"}},
        {"unknown model", "", "", "models isotropc", 2, {"isotropc", "did you mean isotropic?"}},
        {"recipe missing", "", "", "check none.toml", 3, {"none.toml: no such file", "give a recipe"}},
        {"recipe is a folder", "", "", "check .", 3, {".: not a file"}},
    });
}

TEST_CASE("a run that cannot start leaves no output", "[foreign]") {
    check_rows({
        {"run: recipe missing", "", "", "run none.toml -o out", 3, {"none.toml: no such file"}},
        {"run: bad recipe",
         "bad.toml",
         step("model = \"isotropic\"\n"),
         "run bad.toml -o out",
         2,
         {"bad.toml:6: step[0].duration"}},
        {"run: no such option", "good.toml", kGood, "run good.toml -o out --fast", 2, {"--fast"}},
    });
    // A run that needs terabytes is refused by check, too.
    const std::string huge = "[domain]\nextent = [190, 190]\ngrid_spacing = 0.01\n" + kLayer +
                             "[[layer]]\nshape = \"stack\"\nmaterials = [\"SiO2\", \"Si3N4\"]\n"
                             "thicknesses = [0.1, 0.1]\nrepeat = 200\n" +
                             kStep;
    for (const std::string command : {"check huge.toml", "run huge.toml -o out"})
        check_rows(
            {{"memory",
              "huge.toml",
              huge,
              command,
              2,
              {"huge.toml: domain.grid_spacing = 0.01: the run would need about ", "use a spacing of "}}});
}

TEST_CASE("a damaged mesh is a bad input file, whatever reads it", "[foreign]") {
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";
    const std::string vtp =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\">\n<PolyData>\n"
        "<Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\">\n<Points>\n";
    struct Mesh {
        std::string what, file, text;
    };
    const std::vector<Mesh> meshes = {
        {"missing", "", ""},
        {"empty", "bad.ply", ""},
        {"garbage", "bad.ply", "hello\nworld\n"},
        {"header cut short", "bad.ply", header.substr(0, 60)},
        {"vertices cut short", "bad.ply", header + "0 0 0\n1 0\n"},
        {"no triangle", "bad.ply",
         "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
         "property float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"},
        {"NaN vertex", "bad.ply", header + "0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n"},
        {"infinite vertex", "bad.ply", header + "0 0 inf\n1 0 0\n0 1 0\n3 0 1 2\n"},
        {"index out of range", "bad.ply", header + vertices + "3 0 1 7\n"},
        {"index negative", "bad.ply", header + vertices + "3 0 1 -1\n"},
        {"a vast count", "bad.ply",
         "ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty float x\n"
         "property float y\nproperty float z\nend_header\n"},
        {"garbage VTP", "bad.vtp", "hello"},
        {"VTP cut short", "bad.vtp", vtp},
        {"unknown extension", "bad.doc", header + vertices + "3 0 1 2\n"},
    };
    std::vector<Row> rows;
    for (const Mesh& mesh : meshes) {
        const std::string file = mesh.file.empty() ? "none.ply" : mesh.file;
        rows.push_back(
            {"simplify: " + mesh.what, mesh.file, mesh.text, "simplify " + file + " -o out.vtp", 3, {file}});
        rows.push_back(
            {"flux: " + mesh.what, mesh.file, mesh.text, "flux " + file + " -o out.vtp", 3, {file}});
    }
    check_rows(rows);
}

TEST_CASE("bad options of simplify and flux are refused by name", "[foreign]") {
    const std::string triangle =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    const auto row = [&](const std::string& arguments, const std::string& named) {
        return Row{"option", "mesh.ply", triangle, arguments, 2, {named}};
    };
    check_rows({
        row("simplify mesh.ply -o out.vtp --method lindstrom_turk", "method"),
        row("simplify mesh.ply -o out.vtp --l0 -1", "l0"),
        row("simplify mesh.ply -o out.vtp --l0 nan", "l0"),
        row("simplify mesh.ply -o out.vtp --weights 0,0,0", "weights"),
        row("simplify mesh.ply -o out.vtp --weights 1,1", "weights"),
        row("simplify mesh.ply -o out.vtp --weights 1,1,", "weights"),
        row("flux mesh.ply -o out.vtp --sticking 1.5", "sticking"),
        row("flux mesh.ply -o out.vtp --rays 0", "rays"),
        row("flux mesh.ply -o out.vtp --source-exponent -1", "source"),
        {"unwritable",
         "mesh.ply",
         triangle,
         "flux mesh.ply --rays 1000 -o /proc/nowhere/out.vtp",
         5,
         {"/proc/nowhere"}},
    });
}
