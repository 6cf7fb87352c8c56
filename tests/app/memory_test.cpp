#include "app/process/memory.hpp"

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
    CHECK(plain > 400.0 * 1000.0);  // about a kilobyte and more for each of 400 cells
    CHECK(plain < 400.0 * 2000.0);
    CHECK(bytes("stages = \"all\"\n[advection]\ntime_integration = \"rk2\"\n") == Approx(2.0 * plain));
    // A triangle's edge of 1.4 dx into 6 parts, 36 samples, of two triangles a cell; 170 bytes each.
    CHECK(bytes("averaging = 0.05\n") - plain == Approx(400.0 * 2.0 * 36.0 * 170.0));
}
