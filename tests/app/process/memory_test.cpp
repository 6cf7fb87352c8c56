#include "app/process/estimate/memory.hpp"

#include <catch2/catch.hpp>

#include "app/recipe/layers.hpp"

using namespace sidewall;

TEST_CASE("the memory a run needs is counted by cells of surface, and for what a recipe asks beyond") {
    const auto bytes = [](const std::string& settings) {
        const app::Recipe recipe = app::parse_recipe(
            "[domain]\nextent = [2.0, 2.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n"
            "[[step]]\nmodel = \"single_particle\"\nduration = 1.0\nrate = 1.0\ndeposit = "
            "\"SiO2\"\n[flux]\n" +
                settings,
            "memory.toml");
        return app::estimated_memory(recipe, app::domain_of(recipe));
    };
    const double plain = bytes("");
    CHECK(plain > 400.0 * 1000.0);  // one to two kilobytes for each of 400 cells
    CHECK(plain < 400.0 * 2000.0);
    CHECK(bytes("stages = \"all\"\n[advection]\ntime_integration = \"rk2\"\n") == Approx(2.0 * plain));
    // Edges of 1.4 dx in 6 parts: 36 samples a triangle, two triangles a cell, 170 bytes a sample.
    CHECK(bytes("averaging = 0.05\n") - plain == Approx(400.0 * 2.0 * 36.0 * 170.0));
}

TEST_CASE(
    "a grid of several levels takes less memory, where the recipe tells how much of the wafer is fine") {
    const auto bytes = [](const std::string& shape, int levels) {
        const app::Recipe recipe = app::parse_recipe(
            "[domain]\nextent = [400.0, 400.0]\ngrid_spacing = 1.0\nlength_unit = \"nm\"\n[grid]\nlevels = " +
                std::to_string(levels) + "\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"Mask\"\n" +
                shape + "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = 1.0\ndeposit = \"SiO2\"\n",
            "memory.toml");
        return app::estimated_memory(recipe, app::domain_of(recipe));
    };
    const std::string
        fin = "shape = \"fin\"\nwidth = 20.0\nheight = 20.0\n",
        mask = "shape = \"mask\"\nthickness = 20.0\npolygons = [{ points = [-9, -9, 9, -9, 9, 9, -9, 9] }]\n";
    // Walls are a tenth of the flat. They count three times in full, the flat a quarter or a sixteenth.
    const double whole = bytes(fin, 1), cells = 400.0 * 400.0 * 1.1, first = cells * 60.0 * 3.0;
    CHECK(bytes(fin, 2) - first == Approx((whole - first) * (0.3 + 0.25) / 1.1));
    CHECK(bytes(fin, 3) - first == Approx((whole - first) * (0.3 + 0.0625) / 1.1));
    CHECK(bytes(mask, 3) == Approx(bytes(mask, 1)));
}
