#include "app/process/simulation.hpp"
#include "app/recipe/recipe.hpp"
#include "surface/error.hpp"
#include "tests/integration/run_program.hpp"

// Output of the program about materials and their yields.
using namespace sidewall;
using Catch::Matchers::Contains;

namespace {}  // namespace

TEST_CASE("models material lists every material with colour, density and yields, models names a model once") {
    const test::Folder folder;
    const test::Outcome one = test::run_program(folder.path, "models material");
    REQUIRE(one.exit_code == 0);
    for (const app::Material& material : app::default_materials()) {
        CAPTURE(material.name);
        const std::size_t line = one.output.find("\n  " + material.name + " ");
        REQUIRE(line != std::string::npos);
        CHECK_THAT(one.output.substr(line, one.output.find('\n', line + 1) - line),
                   Contains(material.colour));
    }
    CHECK_THAT(one.output, Contains("sf6_o2 sputter_yield") && Contains("fluorocarbon enhanced_yield"));
    const test::Outcome all = test::run_program(folder.path, "models");
    REQUIRE(all.exit_code == 0);
    CHECK(test::count(all.output, "model = \"isotropic\"") == 1);
    CHECK(test::count(all.output, "isotropic |") == 0);
    CHECK(test::count(all.output, "plane |") == 0);
    CHECK(test::count(test::run_program(folder.path, "models hbr_o2").output, "hbr_o2") == 2);
}

TEST_CASE("check prints the values by material, and what it prints is a recipe") {
    const test::Folder folder;
    const test::Outcome printed =
        test::run_program(folder.path, "check --no-estimate " + test::config("quick/sf6o2_hole.toml"));
    REQUIRE(printed.exit_code == 0);
    CHECK_THAT(printed.output, Contains("# step[0] sf6_o2") && Contains("0.0139"));
    std::ofstream(folder.path / "again.toml") << printed.output;
    const test::Outcome again = test::run_program(folder.path, "check --no-estimate again.toml");
    CHECK(again.exit_code == 0);
    CHECK(again.output == printed.output);
}

TEST_CASE("a wafer with a material that a step has no value for does not start the step") {
    const test::Folder folder;
    app::Recipe recipe = app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/sf6o2_hole.toml");
    recipe.layers.at(1).material = "Si3N4";
    CHECK_THROWS_WITH(app::run_recipe(recipe, {.output = folder.path, .quiet = true}),
                      Contains("sf6o2_hole.toml: step 1 sf6_o2: sputter_yield: has no value for Si3N4"));
}
