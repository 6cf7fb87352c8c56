#include <catch2/catch.hpp>

#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/notes.hpp"

// Common words for materials, one word for several sides, one material for a list.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

std::string worded(const std::string& material, const std::string& rest = "") {
    return "[domain]\nextent = [2.0]\ngrid_spacing = 0.1\n" + rest +
           "[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"" + material +
           "\"\nthickness = 0.5\n[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = { " + material +
           " = -0.1 }\nstop_material = \"Si\"\n";
}

}  // namespace

TEST_CASE(
    "a common word for a material is taken as the built-in one, with a note, unless the recipe defines it") {
    for (const auto& [word, name] :
         std::initializer_list<std::pair<std::string, std::string>>{{"photoresist", "Resist"},
                                                                    {"SiN", "Si3N4"},
                                                                    {"oxide", "SiO2"},
                                                                    {"poly", "PolySi"},
                                                                    {"Tungsten", "W"}}) {
        const Recipe recipe = parse_recipe(worded(word), "words.toml");
        CHECK(recipe.layers[1].material == name);
        REQUIRE(recipe.notes.size() == 1);
        CHECK_THAT(recipe.notes[0], Contains(word + " is taken as the built-in " + name));
        CHECK(parse_recipe(effective_recipe(recipe), "words.toml").layers == recipe.layers);
        CHECK(named_figure("volume_" + word, recipe.materials)->material ==
              *material_id(recipe.materials, name));
    }
    const Recipe own = parse_recipe("[[material]]\nname = \"oxide\"\n" + worded("oxide"), "words.toml");
    CHECK(own.layers[1].material == "oxide");
    CHECK(own.notes.empty());
    std::string twice = worded("oxide");
    twice.replace(twice.find("{ oxide = -0.1 }"), 16, "{ oxide = -0.1, SiO2 = -0.2 }");
    CHECK_THROWS_WITH(parse_recipe(twice, "words.toml"), Contains("second value for SiO2"));
    CHECK_THROWS_WITH(parse_recipe(worded("unobtainium"), "words.toml"), Contains("unknown material"));
}

TEST_CASE("one word is the boundary of both sides, in a list, too") {
    for (const char* boundary : {"\"periodic\"", "[\"periodic\"]"})
        for (const char* extent : {"[2.0]", "[2.0, 1.0]"}) {
            std::string text = worded("SiO2", std::string("boundary = ") + boundary + "\n");
            text.replace(text.find("[2.0]"), 5, extent);
            const Recipe recipe = parse_recipe(text, "boundary.toml");
            CHECK(recipe.domain.boundary == std::array{levelset::Side::periodic, levelset::Side::periodic});
        }
    const Recipe profile = parse_recipe(worded("SiO2", "boundary = \"reflective\"\n"), "boundary.toml");
    CHECK(profile.domain.boundary[0] == levelset::Side::reflective);
    CHECK_THROWS_WITH(parse_recipe(worded("SiO2", "boundary = [\"open\"]\n"), "boundary.toml"),
                      Contains("must be one of reflective, periodic"));
}

TEST_CASE("strip takes one material or a list") {
    const auto strips = [](const std::string& material) {
        return parse_recipe(worded("Resist") + "[[step]]\nmodel = \"strip\"\nmaterial = " + material + "\n",
                            "strip.toml");
    };
    for (const char* material :
         {"\"Resist\"", "[\"Resist\"]", "\"photoresist\"", "[\"Polymer\", \"Resist\"]"}) {
        const Recipe recipe = strips(material);
        CHECK(parse_recipe(effective_recipe(recipe), "strip.toml").steps == recipe.steps);
    }
    CHECK_THROWS_WITH(strips("[\"Resist\", \"Si\"]"), Contains("the substrate cannot be taken away"));
    CHECK_THROWS_WITH(strips("[]"), Contains("must not be empty"));
    CHECK_THROWS_WITH(strips("3"), Contains("material"));
}

TEST_CASE("all values that materials lack in all steps are asked for at once") {
    const std::string text =
        "[domain]\nextent = [2.0, 1.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"TiN\"\n"
        "thickness = 0.1\n[[layer]]\nmaterial = \"HfO2\"\nthickness = 0.1\n[[step]]\nmodel = \"sf6_o2\"\nduration = 1.0\n"
        "[[step]]\nmodel = \"hbr_o2\"\nduration = 1.0\n";
    CHECK_THROWS_WITH(
        parse_recipe(text, "all.toml"),
        Contains("step[0].sputter_yield: has no value for TiN and HfO2, which are on the wafer") &&
            Contains("give sputter_yield = { TiN = ..., HfO2 = ... }") && Contains("\nall.toml:") &&
            Contains("step[1].sputter_yield: has no value for TiN and HfO2"));
}
