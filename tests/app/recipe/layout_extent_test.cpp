#include "app/recipe/layout_extent.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <tuple>

#include "app/process/simulation.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "tests/app/recipe/gds_bytes.hpp"
#include "tests/folder.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

// Layer 1: two squares of 1 um, at x = 1.5 and 3.5. Layer 63: a line along x without width, one upward
// through the first square but drawn downward, and one across it at 45 degrees. Layer 64: an L. Layers 66 to
// 68: a square, a triangle and a path half as wide as long. Layer 69: a path a quarter as wide as long.
// Layers 70 and 71: lines of four points, straight but for rounding, and back on itself.
const std::string kChip = test::gds_library(test::gds_cell(
    "TOP", test::gds_boundary(1, 0, {1000, -500, 2000, -500, 2000, 500, 1000, 500}) +
               test::gds_boundary(1, 0, {3000, -500, 4000, -500, 4000, 500, 3000, 500}) +
               test::gds_path(63, 0, 0, {0, 0, 5000, 0}) +
               test::gds_path(63, 0, 10, {1500, 2000, 1500, -2000}) +
               test::gds_boundary(63, 0, {0, -1500, 3000, 1500, 3000, 1510, 0, -1490}) +
               test::gds_path(64, 0, 10, {0, 0, 100, 0, 100, 100}) +
               test::gds_boundary(66, 0, {2000, 3000, 4000, 3000, 4000, 5000, 2000, 5000}) +
               test::gds_boundary(67, 0, {5000, 6000, 7000, 6000, 5000, 8000}) +
               test::gds_path(68, 0, 1000, {0, 0, 2000, 0}) + test::gds_path(69, 0, 1000, {0, 0, 4000, 0}) +
               test::gds_path(70, 0, 0, {0, 0, 1000, 0, 3333, 1, 5000, 1}) +
               test::gds_path(71, 0, 0, {0, 0, 5000, 0, 3000, 0, 5000, 0})));

std::string recipe_on(const test::Folder& folder, const std::string& domain, const std::string& mask = "") {
    std::ofstream(folder.path / "chip.gds", std::ios::binary) << kChip;
    return "[domain]\ngrid_spacing = 0.1\n" + domain +
           "\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"Resist\"\nshape = \"mask\"\nthickness = 0.4\n"
           "file = \"" +
           (folder.path / "chip.gds").string() + "\"\ngds_layer = 1\n" + mask +
           "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n";
}

std::string refusal_of(const std::string& text) {
    try {
        parse_recipe(text, "cut.toml");
    } catch (const Error& error) {
        return error.what();
    }
    return "accepted";
}

}  // namespace

TEST_CASE("a profile along a line of the layout has the line's length and is open where it meets polygons",
          "[foreign]") {
    const test::Folder folder;
    const auto read = [&](const std::string& line, const std::string& domain = "",
                          const std::string& mask = "") {
        return parse_recipe(recipe_on(folder, domain + "[cut]\nlayer = \"63/0\"\nline = " + line, mask),
                            "cut.toml");
    };
    const auto ends = [](const Recipe& recipe) {
        std::vector<double> x;
        for (const Outline& outline : recipe.layers[1].polygons)
            x.insert(x.end(), {outline.points[0], outline.points[2]});
        return x;
    };
    const Recipe along = read("1");
    CHECK(along.domain.extent[0] == Approx(5.0));
    CHECK(along.domain.extent[1] == 0.0);
    CHECK_THAT(ends(along), Catch::Matchers::Approx(std::vector{-1.5, -0.5, 0.5, 1.5}).margin(1e-9));
    Recipe again = parse_recipe(effective_recipe(along), along.file);
    again.notes = along.notes;
    CHECK(again == along);
    CHECK_THAT(ends(read("2")), Catch::Matchers::Approx(std::vector{-0.5, 0.5}).margin(1e-9));
    // The third line is y = x - 1.495, which leaves the square through its top, at x = 1.995.
    const Recipe across = read("3");
    CHECK(across.domain.extent[0] == Approx(4.3));  // 3 sqrt(2) in whole cells
    CHECK_THAT(
        ends(across),
        Catch::Matchers::Approx(std::vector{-0.5 * std::sqrt(2.0), 0.495 * std::sqrt(2.0)}).margin(1e-9));
    CHECK(read("1", "padding = 0.3\n").domain.extent[0] == Approx(5.6));
    CHECK(parse_recipe(recipe_on(folder, "[cut]\nlayer = \"69/0\""), "cut.toml").domain.extent[0] ==
          Approx(4.0));
    CHECK(parse_recipe(recipe_on(folder, "[cut]\nlayer = \"70/0\""), "cut.toml").domain.extent[0] ==
          Approx(5.0));
    CHECK(refusal_of(recipe_on(folder, "[cut]\nlayer = \"71/0\"")) != "accepted");
    CHECK_THAT(ends(read("1", "", "position = [0.2, 0.1]\n")),
               Catch::Matchers::Approx(std::vector{-1.3, -0.3, 0.7, 1.7}).margin(1e-9));
}

TEST_CASE(
    "an etch along a line of the layout removes what two quarter circles and the opening between them hold") {
    const test::Folder folder;
    constexpr double kDepth = 0.3;
    for (const auto& [line, openings, width] :
         {std::tuple{1, 2, 1.0}, {2, 1, 1.0}, {3, 1, 0.995 * std::sqrt(2.0)}}) {
        const Recipe recipe =
            parse_recipe(recipe_on(folder, "[cut]\nlayer = \"63/0\"\nline = " + std::to_string(line)),
                         "cut.toml", {"step[0].rate={ Si = -0.3, default = 0.0 }"});
        const auto result =
            run_recipe(recipe, {.output = folder.path / "out", .overwrite = true, .quiet = true});
        const double expected = openings * (width * kDepth + 0.5 * M_PI * kDepth * kDepth);
        CAPTURE(line);
        // A corner that lies off the grid nodes is cut off by up to half a cell at either end.
        CHECK(result.summary["metrology"]["removed_volume_Si"].get<double>() ==
              Approx(expected).epsilon(0.02));
    }
}

TEST_CASE("a line that is not there, or no line, is refused with what to choose", "[foreign]") {
    const test::Folder folder;
    struct Row {
        std::string domain, mask, what;
    };
    const Row rows[] = {
        {"[cut]\nlayer = \"63/0\"", "", "3: cut.line: the layer holds 3 lines: choose one, from 1 to 3"},
        {"[cut]\nlayer = \"63/0\"\nline = 4", "", "5: cut.line = 4: the layer holds 3"},
        {"[cut]\nlayer = \"64/0\"", "", "4: cut.layer = \"64/0\": holds a shape that is no straight line"},
        {"[cut]\nlayer = \"66/0\"", "", "4: cut.layer = \"66/0\": holds a box that is no line at (2, 3)"},
        {"[cut]\nlayer = \"67/0\"", "",
         "4: cut.layer = \"67/0\": holds a shape that is no straight line at (5, 6)"},
        {"[cut]\nlayer = \"68/0\"", "", "4: cut.layer = \"68/0\": holds a box that is no line at (2, 0.5)"},
        {"[cut]\nlayer = \"65/0\"", "", "no polygon on layer 65, datatype 0"},
        {"[cut]\nlayer = \"63\"", "", "such as \"63/0\""},
        {"[cut]", "", "cut.layer: missing"},
        {"length_unit = \"um\"\n[[cut]]\nlayer = \"63/0\"", "", "must be a section"},
        {"extent = [4]\n[cut]\nlayer = \"63/0\"\nline = 1", "", "domain.extent = "},
        {"[cut]\nlayer = \"63/0\"\nline = 1", "position = [0, 9]\n", "do not meet the line"},
        {"[cut]\nlayer = \"63/0\"\nline = 1", "blur = [0.1]\n", "blurred outlines end along y"},
    };
    for (const Row& row : rows) {
        const std::string answer = refusal_of(recipe_on(folder, row.domain, row.mask));
        INFO(row.domain << "\n" << answer);
        CHECK(answer.starts_with("cut.toml:"));
        CHECK(answer.find(row.what) != std::string::npos);
    }
}

TEST_CASE("the extent may be that of a layer of its own", "[foreign]") {
    const test::Folder folder;
    const Recipe recipe = parse_recipe(recipe_on(folder, "extent = \"gds:63/0\"\n"), "frame.toml");
    CHECK(recipe.domain.extent[0] == Approx(5.0));
    CHECK(recipe.domain.extent[1] == Approx(4.0));
    CHECK(recipe.layers[1].position[0] == Approx(-2.5));
    CHECK(recipe.layers[1].position[1] == Approx(0.0).margin(1e-12));
}

TEST_CASE("a profile along a line tells of cells that the layout's file does not hold", "[foreign]") {
    const test::Folder folder;
    const std::string text = recipe_on(folder, "[cut]\nlayer = \"63/0\"");
    std::ofstream(folder.path / "chip.gds", std::ios::binary) << test::gds_library(test::gds_cell(
        "TOP", test::gds_boundary(1, 0, {1000, -500, 2000, -500, 2000, 500, 1000, 500}) +
                   test::gds_path(63, 0, 0, {0, 0, 5000, 0}) + test::gds_reference("GHOST", {0, 0})));
    const Recipe recipe = parse_recipe(text, "cut.toml");
    CHECK(std::ranges::any_of(recipe.notes, [](const std::string& note) {
        return note.starts_with("layer[1].file: ") && note.find("without: GHOST") != std::string::npos;
    }));
}
