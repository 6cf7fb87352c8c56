#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>

#include "app/process/estimate/memory.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/layers.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/step_materials.hpp"
#include "tests/folder.hpp"

// Layers that are cut out or placed freely, and lithography between steps, as recipes write them.
using namespace sidewall;
using namespace sidewall::app;

namespace {

const std::string kHead =
    "[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n";  // lines 1 to 5
const std::string kStep = "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n";
const std::string kLines = SIDEWALL_SOURCE_DIR "/configs/masks/lines.gds";

std::string flow_message(const std::string& text) {
    try {
        parse_recipe(text, "bad.toml");
    } catch (const Error& error) {
        return error.what();
    }
    return "accepted";
}

// `lines` start at line 7 of the recipe.
std::string with_layer(const std::string& lines) {
    return flow_message(kHead + "[[layer]]\n" + lines + kStep);
}

std::string with_step(const std::string& lines) {
    return flow_message(kHead + "[[step]]\n" + lines + kStep);
}

}  // namespace

TEST_CASE("an effective recipe with every new shape and step parses back to an equal one", "[foreign]") {
    const test::Folder folder;
    std::ofstream(folder.path / "bump.csv") << "x, z\n0, 0.5\n0.5, 0.3\n1.0, 0\n";
    const std::string cut = "[[layer]]\nsubtract = true\nshape = ",
                      add = "[[layer]]\nmaterial = \"SiO2\"\nshape = ";
    const Recipe recipe = parse_recipe(
        kHead + cut + "\"sphere\"\nradius = 0.5\nz = -1.0\n" + add +
            "\"cylinder\"\nradius = 0.4\naxis = \"x\"\n" + cut +
            "\"gap\"\nheight = 0.3\nlength = 1.5\nz = -0.5\n" + cut +
            "\"hole\"\nradius = 0.7\ndepth = 0.4\n" + cut +
            "\"box\"\nsize = [1, 1]\nheight = 0.5\nradius = 0.1\ntop = -2\n" + cut +
            "\"mask\"\ndepth = 0.5\npolygons = [{ points = [0, 0, 1, 0, 1, 1] }]\n" + add +
            "\"profile\"\nfile = \"bump.csv\"\nsweep = \"revolution\"\n" + add +
            "\"mask\"\nthickness = 0.3\nbase = 0.5\npolygons = [{ points = [0, 0, 1, 0, 1, 1] }]\n" +
            "[[step]]\nmodel = \"mask\"\nmaterial = \"Resist\"\nthickness = 0.3\nconformal = true\nfile = \"" +
            kLines + "\"\ngds_layer = 1\n" +
            "[[step]]\nmodel = \"cut\"\nmaterials = [\"SiO2\", \"Resist\"]\nshape = \"hole\"\nradius = 0.5\n" +
            "[[step]]\nmodel = \"cut\"\ndepth = 1.0\nshape = \"box\"\nsize = [1, 2]\nopenings = false\n" +
            kStep,
        (folder.path / "x.toml").string());
    const std::string written = effective_recipe(recipe);
    INFO(written);
    CHECK(parse_recipe(written, recipe.file) == recipe);
    CHECK(recipe.layers[2].z == 0.0);    // at the flat surface
    CHECK(recipe.layers[8].top == 0.8);  // above the base
    const std::vector<MaterialLayer> layers = expanded_layers(recipe);
    REQUIRE(layers.size() == 9);
    CHECK(layers[1].material == -1);
    CHECK(layers[1].shape.subtract);
    CHECK(std::isinf(layers[2].shape.length));
    CHECK(layers[2].shape.axis == 0);
    CHECK(layers[3].shape.length == 1.5);
    CHECK(std::isinf(layers[3].shape.width));
    CHECK(layers[7].shape.profile.size() == 3);
    CHECK(estimated_memory(recipe, domain_of(recipe)) > 0.0);
    // The mask is on the wafer when something etches.
    const auto met = materials_by_step(recipe);
    REQUIRE(met.size() == 1);
    CHECK(std::count(met[0].ids.begin(), met[0].ids.end(), *material_id(recipe.materials, "Resist")) == 1);
}

TEST_CASE("layers that make no sense are refused with line, key and remedy", "[foreign]") {
    const test::Folder folder;
    const auto file = [&](const std::string& name, const std::string& text) {
        std::ofstream(folder.path / name) << text;
        return "file = \"" + (folder.path / name).string() + "\"\n";
    };
    const std::string profile = "material = \"Si\"\nshape = \"profile\"\n";
    struct Row {
        std::string lines, place, remedy;
    };
    const Row rows[] = {
        {"material = \"Si\"\nshape = \"sphere\"\nsubtract = true\nradius = 1\n",
         "7: layer[1].material = ", "drop it"},
        {"subtract = true\nshape = \"sphere\"\n", "6: layer[1].radius: missing", "needs it"},
        {"subtract = true\nshape = \"sphere\"\nradius = 0\n", "9: layer[1].radius = ", "greater than 0"},
        {"subtract = true\nshape = \"sphere\"\nradius = 0.09\n",
         "9: layer[1].radius = ", "use a grid_spacing"},
        {"subtract = true\nshape = \"sphere\"\nradius = 0.5\nposition = [9, 0]\n",
         "10: layer[1].position = ", "inside"},
        {"subtract = true\nshape = \"sphere\"\nradius = 0.5\nz = 1e5\n",
         "10: layer[1].z = ", "check the unit"},
        {"subtract = true\nshape = \"sphere\"\nradius = 9\n",
         "9: layer[1].radius = ", "covers the whole domain"},
        {"subtract = true\nshape = \"sphere\"\nradius = 1\ntop = 1\n", "10: layer[1].top = ", "unknown key"},
        {"subtract = 1\nshape = \"sphere\"\nradius = 1\n", "7: layer[1].subtract = 1: ", "true or false"},
        {"subtract = true\nshape = \"plane\"\n", "7: layer[1].subtract = ", "unknown key"},
        {"subtract = true\nshape = \"hole\"\nradius = 1\n", "6: layer[1].depth: missing", "needs it"},
        {"subtract = true\nshape = \"gap\"\nheight = 0.1\nlength = 2\n",
         "9: layer[1].height = ", "cells high"},
        {"subtract = true\nshape = \"gap\"\nheight = 1\n", "6: layer[1].length: ", "covers the whole domain"},
        {"subtract = true\nshape = \"gap\"\nheight = 1\nwidth = 0.1\n",
         "10: layer[1].width = ", "use a grid_spacing"},
        {"subtract = true\nshape = \"cylinder\"\nradius = 1\naxis = \"w\"\n",
         "10: layer[1].axis = ", "one of x, y, z"},
        {"subtract = true\nshape = \"cylinder\"\nradius = 1\naxis = \"z\"\n", "6: layer[1].length: missing",
         "end somewhere"},
        {"material = \"Si\"\nshape = \"box\"\nsize = [1, 2]\nheight = 2\nradius = 0.6\n",
         "11: layer[1].radius = ", "use less than 0.5"},
        {"material = \"Si\"\nshape = \"mask\"\nthickness = 1\nbase = 3\ntop = 2\n", "",
         "give top or thickness"},
        {"material = \"Si\"\nshape = \"mask\"\nbase = 3\ntop = 2\n",
         "9: layer[1].base = ", "below the mask's top"},
        {"subtract = true\nshape = \"mask\"\npolygons = [{ points = [0, 0, 1, 0, 1, 1] }]\n",
         "6: layer[1].depth: missing", "end somewhere"},
        {"material = \"Si\"\nshape = \"mask\"\nthickness = 1\ndepth = 1\n",
         "10: layer[1].depth = ", "subtract = true"},
        {profile, "6: layer[1].file: missing", "CSV"},
        {profile + "file = \"none.csv\"\n", "9: layer[1].file = ", "no such file"},
        {profile + file("a.csv", "0, 1\n1; 2\nx, y\n"),
         "9: layer[1].file: ", "a.csv:2: 1 values in a table of 2 columns"},
        {profile + file("b.csv", "0, 1\n2\n"), "9: layer[1].file: ", "b.csv:2: "},
        {profile + file("c.csv", "# nothing\n"), "9: layer[1].file: ", "no row of numbers"},
        {profile + file("l.csv", "1, 0\n1, 0\n"), "9: layer[1].file: ", "fewer than two"},
        {profile + file("m.csv", "x [V], z\n1, 0\n2, 0\n"),
         "9: layer[1].file: ", "says V, which is no length"},
        {profile + file("n.csv", "x,z,polyline\n1, 0, 0\n2, 0, 0\n1, 1, 1\n"),
         "9: layer[1].file: ", "several lines"},
        {profile + file("d.csv", "0, 1\n1, nan\n"), "9: layer[1].file: ", "d.csv:2: "},
        {profile + file("e.csv", "-1, 0\n1, 1\n1, 0\n-1, 1\n-1, 0\n"),
         "9: layer[1].file = ", "crosses itself"},
        {profile + file("f.csv", "-1, 0\n1, 1\n") + "sweep = \"revolution\"\n",
         "9: layer[1].file = ", "extrusion"},
        {profile + file("g.csv", "8, 0\n9, 1\n"), "9: layer[1].file = ", "outside the domain"},
        {profile + file("h.csv", "0, 0\n0.1, 0\n0.1, 1\n0, 0\n"),
         "9: layer[1].file = ", "use a grid_spacing"},
        {profile + file("i.csv", "-1, 0\n1, 9e5\n"), "9: layer[1].file = ", "check the unit"},
        {profile + file("j.csv", "0, 0\n1, 1\n0, 2\n"), "9: layer[1].file = ", "one side to the other"},
    };
    for (const Row& row : rows) {
        const std::string answer = with_layer(row.lines);
        INFO(row.lines << "\n" << answer);
        CHECK(answer.starts_with("bad.toml:" + row.place));
        CHECK(answer.find(row.remedy) != std::string::npos);
    }
    // Nothing lies below the first layer.
    const std::string first = "[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.1\n[[layer]]\n";
    CHECK(flow_message(first + "shape = \"gap\"\nsubtract = true\nheight = 1\nlength = 1\n" + kStep)
              .starts_with("bad.toml:6: layer[0].subtract = true: nothing lies below"));
    CHECK(flow_message(first + "shape = \"sphere\"\nmaterial = \"Si\"\nradius = 1\n" + kStep)
              .starts_with("bad.toml:5: layer[0].shape = \"sphere\": a sphere stands on a substrate"));
    CHECK(flow_message(first + profile + file("k.csv", "0, 0\n1, 0\n1, 1\n0, 0\n") + kStep)
              .find("closed outline") != std::string::npos);
}

TEST_CASE("masks and cuts that make no sense are refused with line, key and remedy", "[foreign]") {
    const std::string mask = "model = \"mask\"\nmaterial = \"Resist\"\nthickness = 0.5\n",
                      cut = "model = \"cut\"\n";
    struct Row {
        std::string lines, place, remedy;
    };
    const Row rows[] = {
        {"model = \"mask\"\nthickness = 0.5\n", "6: step[0].material: missing", "needs it"},
        {mask, "6: step[0].polygons: ", "either polygons or the file"},
        {mask + "shape = \"hole\"\n", "6: step[0].radius: missing", "needs it"},
        {mask + "shape = \"fin\"\n", "10: step[0].shape = \"fin\": ", "one of polygons, trench, hole, box"},
        {mask + "shape = \"hole\"\nradius = 0.05\n", "11: step[0].radius = ", "use a grid_spacing"},
        {mask + "shape = \"hole\"\nradius = 1\nwidth = 2\n", "12: step[0].width = ", "unknown key"},
        {mask + "shape = \"trench\"\nwidth = 9\n", "11: step[0].width = ", "covers the whole domain"},
        {mask + "shape = \"box\"\nsize = [1, 1]\nposition = [5, 0]\n", "12: step[0].position = ", "inside"},
        {mask + "polygons = [{ points = [0, 0, 1, 1, 1, 0, 0, 1] }]\n",
         "10: step[0].polygons[0].points = ", "crosses itself"},
        {mask + "file = \"none.gds\"\n", "10: step[0].file = ", "no such file"},
        {mask + "file = \"" + kLines + "\"\ngds_layer = 9\n", "11: step[0].gds_layer = 9: ", "no polygon"},
        {mask + "openings = 1\n", "10: step[0].openings = 1: ", "true or false"},
        {mask + "duration = 1\n", "10: step[0].duration = ", "unknown key"},
        {"model = \"mask\"\nmaterial = \"Resist\"\nthickness = 0\n",
         "9: step[0].thickness = ", "greater than 0"},
        {"model = \"mask\"\nmaterial = \"Resist\"\nthickness = 1e6\nshape = \"hole\"\nradius = 1\n",
         "9: step[0].thickness = ", "check the unit"},
        {cut + "shape = \"hole\"\nradius = 1\n", "6: step[0].depth: missing", "end somewhere"},
        {cut + "shape = \"hole\"\nradius = 1\nmaterials = [\"Si\"]\n", "6: step[0].depth: missing",
         "end somewhere"},
        {cut + "shape = \"hole\"\nradius = 1\ndepth = \"through\"\n",
         "10: step[0].depth = ", "end somewhere"},
        {cut + "shape = \"hole\"\nradius = 1\ndepth = 1e6\n", "10: step[0].depth = ", "check the unit"},
        {cut + "shape = \"hole\"\nradius = 1\nmaterials = [\"Sio\"]\n",
         "10: step[0].materials[0] = ", "did you mean Si"},
    };
    for (const Row& row : rows) {
        const std::string answer = with_step(row.lines);
        INFO(row.lines << "\n" << answer);
        CHECK(answer.starts_with("bad.toml:" + row.place));
        CHECK(answer.find(row.remedy) != std::string::npos);
    }
    CHECK(with_step(cut + "shape = \"hole\"\nradius = 1\nmaterials = [\"SiO2\"]\n") == "accepted");
    CHECK(with_step(cut + "shape = \"hole\"\nradius = 1\ndepth = -0.5\n") == "accepted");
    // A cut may reach below the lowest point so far, and a polish after it may, too.
    const std::string polish = "[[step]]\nmodel = \"planarize\"\nheight = -1.0\n";
    CHECK(with_step("model = \"strip\"\nmaterial = \"Si\"\n").find("the substrate cannot be taken away") !=
          std::string::npos);
    CHECK(with_step("model = \"strip\"\nmaterial = \"SiO2\"\n" + polish).find("step[1].height") !=
          std::string::npos);
    CHECK(with_step(cut + "shape = \"hole\"\nradius = 1\ndepth = 1.5\n" + polish) == "accepted");
}

TEST_CASE("outlines are blurred and cut, and blur that makes no sense is refused with line, key and remedy",
          "[foreign]") {
    const std::string
        lines = "model = \"mask\"\nmaterial = \"Resist\"\nthickness = 0.4\nfile = \"" + kLines +
                "\"\ngds_layer = 1\n",
        hairline =
            "model = \"cut\"\ndepth = 0.5\npolygons = [{ points = [-1, -1, 1, -1, 1, 1, -1, 1] }, "
            "{ points = [1.4, -2, 1.5, -2, 1.5, 2, 1.4, 2] }]\n";
    const Recipe recipe = parse_recipe(
        kHead + "[[step]]\n" + lines + "blur = [0.05, 0.2]\nblur_weights = [3, 1]\nblur_threshold = 0.4\n" +
            "[[step]]\n" + hairline + "blur = [0.1]\n" + kStep,
        "blur.toml");
    CHECK(parse_recipe(effective_recipe(recipe), recipe.file) == recipe);
    const levelset::Shape mask = pattern_of(recipe.steps[0], recipe),
                          cut = pattern_of(recipe.steps[1], recipe);
    CHECK(mask.contours);
    CHECK(mask.polygons.size() > 2);
    CHECK(cut.contours);
    const std::string vanished =
        "step[1].blur: 1 of 2 outlines are too narrow to print and vanish, the first near (1.4, -2)";
    CHECK(std::count(recipe.notes.begin(), recipe.notes.end(), vanished) == 1);

    struct Row {
        std::string lines, place, remedy;
    };
    const Row rows[] = {
        {lines + "blur = 0.1\n", "12: step[0].blur = ", "a list of numbers"},
        {lines + "blur = [0.1, 0]\n", "12: step[0].blur[1] = 0", "greater than 0"},
        {lines + "blur = [9]\n", "12: step[0].blur[0] = ", "check the unit"},
        {lines + "blur = [0.05, 0.1]\nblur_weights = [1]\n", "13: step[0].blur_weights = ", "as many as"},
        {lines + "blur = [0.05]\nblur_weights = [-1]\n", "13: step[0].blur_weights[0] = ", "greater than 0"},
        {lines + "blur_weights = [1]\n", "12: step[0].blur_weights = ", "give blur"},
        {lines + "blur_threshold = 0.5\n", "12: step[0].blur_threshold = ", "give blur"},
        {lines + "blur = [0.05]\nblur_threshold = 1.0\n", "13: step[0].blur_threshold = ", "less than 1"},
        {lines + "blur = [0.05]\nblur_threshold = 0\n", "13: step[0].blur_threshold = ", "in (0, 1]"},
        {lines + "blur = [3]\nblur_threshold = 0.9\n", "12: step[0].blur = ", "nothing prints"},
        {lines + "blur = [3]\nblur_threshold = 0.1\n", "12: step[0].blur = ", "everything prints"},
        {lines + "blurr = [3]\n", "12: step[0].blurr = ", "did you mean blur?"},
        {"model = \"mask\"\nmaterial = \"Resist\"\nthickness = 0.4\nshape = \"hole\"\nradius = 1\nblur = [0.1]\n",
         "12: step[0].blur = ", "unknown key"},
    };
    for (const Row& row : rows) {
        const std::string answer = with_step(row.lines);
        INFO(row.lines << "\n" << answer);
        CHECK(answer.starts_with("bad.toml:" + row.place));
        CHECK(answer.find(row.remedy) != std::string::npos);
    }
}

TEST_CASE("the extent is the layout's with padding, in whole cells, and the layout is centred", "[foreign]") {
    const auto recipe = [](const std::string& domain, const std::string& mask) {
        return "[domain]\n" + domain +
               "\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"Resist\"\nshape = \"mask\"\n" +
               "thickness = 0.4\n" + mask + kStep;
    };
    // Layer 1 reaches from -1.4 to 1.6 along x and from -1.5 to 1.5 along y.
    const std::string file = "file = \"" + kLines + "\"\ngds_layer = 1\n";
    const Recipe read =
        parse_recipe(recipe("extent = \"gds\"\ngrid_spacing = 0.3\npadding = 0.5", file), "layout.toml");
    CHECK(read.domain.extent[0] == Approx(4.2));
    CHECK(read.domain.extent[1] == Approx(4.2));
    CHECK(read.layers[1].position[0] == Approx(-0.1));
    CHECK(read.layers[1].position[1] == Approx(0.0).margin(1e-12));
    REQUIRE(!read.notes.empty());
    CHECK(read.notes[0] == "domain.extent = \"gds\" is 4.2 x 4.2 um: the layout's (0.1, 0) is at the centre");
    Recipe again = parse_recipe(effective_recipe(read), read.file);
    again.notes = read.notes;
    CHECK(again == read);
    // The spacing that the error message suggests is accepted.
    CHECK_NOTHROW(
        parse_recipe(recipe("extent = \"gds\"\ngrid_spacing = 0.5\npadding = 0.5", file), "layout.toml"));
    // A `position` moves one mask relative to the others.
    const Recipe moved =
        parse_recipe(recipe("extent = \"gds\"\ngrid_spacing = 0.1", file + "position = [5, 1]\n") +
                         "[[step]]\nmodel = \"cut\"\ndepth = 1\n" + file,
                     "layout.toml");
    CHECK(moved.domain.extent[0] == Approx(8.0));
    CHECK(moved.domain.extent[1] == Approx(4.0));
    CHECK(moved.layers[1].position[0] - moved.steps[1].pattern.position[0] == Approx(5.0));

    struct Row {
        std::string domain, mask, place, remedy;
    };
    const Row rows[] = {
        {"extent = \"gdsii\"\ngrid_spacing = 0.1", file, "2: domain.extent = \"gdsii\": ", "\"gds\""},
        {"extent = \"gds:1\"\ngrid_spacing = 0.1", file, "2: domain.extent = \"gds:1\": ", "gds:63/0"},
        {"extent = \"gds:9/0\"\ngrid_spacing = 0.1", file, "2: domain.extent = \"gds:9/0\": ", "layer 9"},
        {"extent = \"gds\"", file, "1: domain.grid_spacing: missing", "needs it"},
        {"extent = \"gds\"\ngrid_spacing = 0", file, "3: domain.grid_spacing = 0: ", "greater than 0"},
        {"extent = \"gds\"\ngrid_spacing = 0.1\npadding = -1", file,
         "4: domain.padding = -1: ", "at least 0"},
        {"extent = [4, 4]\ngrid_spacing = 0.1\npadding = 1", file, "4: domain.padding = 1: ", "drop it"},
        {"extent = \"gds\"\ngrid_spacing = 0.1", "polygons = [{ points = [0, 0, 1, 0, 1, 1] }]\n",
         "2: domain.extent = \"gds\": ", "give two lengths"},
        {"extent = \"gds\"\ngrid_spacing = 0.1", "file = \"none.gds\"\n",
         "10: layer[1].file = ", "no such file"},
        {"extent = \"gds\"\ngrid_spacing = 0.1", "file = \"" + kLines + "\"\ngds_layer = 9\n",
         "11: layer[1].gds_layer = 9: ", "no polygon"},
        {"extent = \"gds\"\ngrid_spacing = 1e-5", file, "3: domain.grid_spacing = ", "larger spacing"},
        {"extent = \"gds\"\ngrid_spacing = 100\npadding = 0.5", file,
         "3: domain.grid_spacing = 100: ", "use a spacing of 0.5 or less"},
    };
    for (const Row& row : rows) {
        const std::string answer = flow_message(recipe(row.domain, row.mask));
        INFO(row.domain << "\n" << answer);
        CHECK(answer.starts_with("bad.toml:" + row.place));
        CHECK(answer.find(row.remedy) != std::string::npos);
    }
}

TEST_CASE("recipes that are compared with another simulator's are accepted") {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(SIDEWALL_SOURCE_DIR "/configs/peer")) {
        INFO(entry.path());
        CHECK_NOTHROW(load_recipe(entry.path()));
        ++count;
    }
    CHECK(count == 8);
}
