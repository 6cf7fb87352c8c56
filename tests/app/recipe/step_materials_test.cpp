#include "app/recipe/step_materials.hpp"
#include "app/recipe/effective_recipe.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/recipe/step_model.hpp"

// Yields by material: published, given, or asked for.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

// A wafer with this mask. Chromium is not built in and defined here.
std::string wafer(const std::string& mask) {
    return (mask == "Cr" ? std::string("[[material]]\nname = \"Cr\"\ndensity = 8.33\n") : std::string()) +
           R"([domain]
extent = [1.0, 1.0]
grid_spacing = 0.1
boundary = "periodic"
[[layer]]
material = "Si"
[[layer]]
material = ")" +
           mask + "\"\nshape = \"trench\"\nthickness = 0.2\nwidth = 0.5\n";
}

Recipe under_mask(const std::string& mask, const std::string& steps) {
    return parse_recipe(wafer(mask) + steps, "mask.toml");
}

std::string etch(const std::string& model) {
    return "[[step]]\nmodel = \"" + model + "\"\nduration = 1.0\n";
}

double yield(const Recipe& recipe, const std::string& material) {
    const Step& step = recipe.steps.front();
    const Model model = make_model(step, recipe.materials, recipe.domain);
    return model.species.at(0).yields.at(0).scale.at(
        static_cast<std::size_t>(*material_id(recipe.materials, material)));
}

}  // namespace

TEST_CASE("a plasma etches a mask by a published yield, or asks for one") {
    for (const std::string model : {"sf6_o2", "hbr_o2"}) {
        CHECK(yield(under_mask("SiO2", etch(model)), "SiO2") == 0.0139);
        CHECK(yield(under_mask("Mask", etch(model)), "Mask") == 0.0139);
        for (const std::string mask : {"Si3N4", "Resist", "TiN", "HfO2", "SiGe", "Polymer"}) {
            CHECK_THROWS_WITH(under_mask(mask, etch(model)),
                              Contains("mask.toml:12: step[0].sputter_yield: has no value for " + mask) &&
                                  Contains("give sputter_yield = { " + mask + " = ... }"));
            CHECK(yield(under_mask(mask, etch(model) + "sputter_yield = { " + mask + " = 0.02 }\n"), mask) ==
                  0.02);
            CHECK(yield(under_mask(mask, etch(model) + "sputter_yield = 0.03\n"), mask) == 0.03);
        }
    }
    // A yield given for one material does not serve another.
    CHECK_THROWS_WITH(under_mask("TiN", etch("hbr_o2") + "sputter_yield = { W = 0.1 }\n"),
                      Contains("step[0].sputter_yield = {...}: has no value for TiN"));
    // Fluorocarbon: silicon has a sputter yield, but no ion-enhanced one; the film needs none.
    const std::string contact = etch("fluorocarbon") + "deposit = \"Carbon\"\n";
    CHECK_THROWS_WITH(under_mask("Mask", contact), Contains("enhanced_yield: has no value for Si, "));
    CHECK_NOTHROW(under_mask("Mask", contact + "enhanced_yield = { Si = 0.01 }\n"));
    CHECK_THROWS_WITH(parse_recipe(wafer("Cr") +
                                       "[[material]]\nname = \"Own\"\n[[layer]]\nmaterial = \"Own\"\n"
                                       "thickness = 0.1\n" +
                                       etch("sf6_o2"),
                                   "own.toml"),
                      Contains("has no value for Own"));
}

TEST_CASE("published yields take as much of a material as argon was seen to mill") {
    // um^3/nC at 500 eV and normal incidence; a charge per ion of 1.602e-19 C.
    const double root = std::sqrt(500.0) - std::sqrt(20.0);
    for (const auto& [material, milled] : {std::pair("Al2O3", 0.01667),
                                           {"Carbon", 0.00733},
                                           {"Cr", 0.09667},
                                           {"Cu", 0.18333},
                                           {"Ge", 0.16667}}) {
        const Recipe recipe = under_mask(material, etch("sf6_o2"));
        const double density =
            recipe.materials[static_cast<std::size_t>(*material_id(recipe.materials, material))].density;
        CHECK(yield(recipe, material) * root / density == Approx(milled * 1.602).epsilon(0.01));
    }
    // Tungsten at 202.3 eV: Eckstein (2007).
    CHECK(yield(under_mask("W", etch("sf6_o2")), "W") * (std::sqrt(202.3) - std::sqrt(20.0)) ==
          Approx(0.2732).epsilon(0.01));
}

TEST_CASE("a step is asked for the materials it can meet, and for no others") {
    const std::string nitride = "[[step]]\nmodel = \"conformal\"\nmaterial = \"Si3N4\"\nthickness = 0.1\n",
                      film = etch("isotropic") + "rate = 0.1\ndeposit = \"Resist\"\n",
                      strip = "[[step]]\nmodel = \"strip\"\nmaterial = \"Si3N4\"\n";
    CHECK_NOTHROW(under_mask("Mask", etch("sf6_o2") + nitride));
    CHECK_THROWS_WITH(under_mask("Mask", nitride + etch("sf6_o2")), Contains("step[1].sputter_yield"));
    CHECK_NOTHROW(under_mask("Mask", nitride + strip + etch("sf6_o2")));
    CHECK_THROWS_WITH(under_mask("Mask", film + etch("sf6_o2")), Contains("Resist"));
    // In a loop the film of a cycle meets the next cycle's etching.
    const auto loop = [&](const std::string& repeat) {
        return "[[step]]\nrepeat = " + repeat +
               "\n[[step.steps]]\nmodel = \"sf6_o2\"\nduration = 1.0\n"
               "[[step.steps]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = 0.1\ndeposit = \"Resist\"\n";
    };
    CHECK_NOTHROW(under_mask("Mask", loop("1")));
    CHECK_THROWS_WITH(under_mask("Mask", loop("2")),
                      Contains("step[0].steps[0].sputter_yield") && Contains("Resist"));
}

TEST_CASE("the table of values by material is a comment, and shows what is in force") {
    const Recipe recipe = under_mask("Si3N4", etch("hbr_o2") + "sputter_yield = { Si3N4 = 0.02 }\n");
    const std::string text = effective_recipe(recipe), table = values_by_material(recipe);
    CHECK(parse_recipe(text + table, "mask.toml") == recipe);
    CHECK_THAT(table, Contains("# step[0] hbr_o2\n"));
    CHECK_THAT(table, Contains("#  Si3N4     0.1*              1*               0.02           1.36\n"));
    CHECK_THAT(table, Contains("#  Si        0.1*              1*               0.5            5.02\n"));
    CHECK(table.find("SiO2") == std::string::npos);
    // A list of tables shows the values of each of its tables.
    const std::string several = values_by_material(under_mask(
        "Mask",
        etch("multi_particle") + "species = [{ name = \"a\", rate = { Si = -1.0, Mask = -0.1 } }]\n"));
    CHECK_THAT(several, Contains("species[0].rate") && Contains("-0.1"));
    CHECK(values_by_material(under_mask("Mask", "[[step]]\nmodel = \"planarize\"\nheight = 0.1\n")).empty());
}
