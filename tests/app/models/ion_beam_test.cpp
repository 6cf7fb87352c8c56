#include <catch2/catch.hpp>

#include "app/recipe/notes.hpp"
#include "app/recipe/step_model.hpp"

// Sputtering by an ion beam, and redeposition.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

Recipe with_mask(const std::string& mask, const std::string& step) {
    return parse_recipe(R"([domain]
extent = [1.0, 1.0]
grid_spacing = 0.1
boundary = "periodic"
[[layer]]
material = "Si"
[[layer]]
material = ")" + mask + "\"\nshape = \"trench\"\nthickness = 0.2\nwidth = 0.5\n" +
                            step,
                        "mask.toml");
}

const std::string kPlain = "[[step]]\nmodel = \"ion_beam\"\nduration = 1.0\n",
                  kBeam = kPlain + "deposit = \"PolySi\"\n";

}  // namespace

TEST_CASE("ion_beam: atoms that leave and atoms that land make the speed, by the materials' densities") {
    const Recipe recipe = with_mask(
        "SiO2", kBeam + "rate = { Si = 0.02, SiO2 = 0.01, PolySi = 0.03 }\nredeposition_fraction = 0.8\n");
    const Model model = make_model(recipe.steps.front(), recipe.materials, recipe.domain);
    const flux::Species& ion = model.species.at(0);
    const auto speed = [&](const char* material, double yields, double landing) {
        const std::vector<double> flux{1.0, yields, landing};
        return model.speed({*material_id(recipe.materials, material), flux});
    };
    // The yield at which a flat wafer etches at its rate, and the flux of redeposited atoms that it makes.
    const double flat = 0.02 / -speed("Si", 1.0, 0.0);
    const auto emitted_by = [&](const char* material) {
        return flat * ion.redeposition->yield.scale.at(
                          static_cast<std::size_t>(*material_id(recipe.materials, material)));
    };
    for (const auto& [material, rate, density] :
         {std::tuple("Si", 0.02, 5.02), {"SiO2", 0.01, 2.2}, {"PolySi", 0.03, 5.0}}) {
        CHECK(speed(material, flat, 0.0) == Approx(-rate));
        // All redeposited atoms land where they came from: at a fraction of 0.8 a fifth of the rate is left.
        CHECK(speed(material, flat, emitted_by(material)) == Approx(-0.2 * rate));
        // Where nothing is sputtered they grow a film of as many atoms.
        CHECK(speed(material, 0.0, emitted_by(material)) == Approx(0.8 * rate * density / 5.0));
    }
    CHECK_NOTHROW(with_mask("Mask", kBeam + "rate = 0.02\n"));  // no redeposition, for comparison
    CHECK_THROWS_WITH(with_mask("Mask", kPlain + "rate = 0.02\nredeposition_fraction = 1\n"),
                      Contains("step[0].deposit: missing: what redeposits is a film"));
    // A redeposited film to which the recipe gives no rate would shield the wafer for good.
    const std::string half = "redeposition_fraction = 0.5\n";
    CHECK_THROWS_WITH(with_mask("Mask", kBeam + half + "rate = { Si = 0.02 }\n"),
                      Contains("mask.toml:17: step[0].rate") && Contains("add PolySi = 0.02008"));
    CHECK_NOTHROW(with_mask("Mask", kBeam + half + "rate = 0.02\n"));
    CHECK_THROWS_WITH(with_mask("Mask", kBeam + half + "rate = 0.02\nredeposition_rate = 0.1\n"),
                      Contains("step[0].redeposition_rate = 0.1: takes the place of redeposition_fraction"));
    CHECK_THROWS_WITH(with_mask("Mask", kBeam + "rate = 0.02\nredeposition_fraction = 1.1\n"),
                      Contains("must be in [0, 1]"));
    CHECK_THROWS_WITH(
        with_mask("SiO2", kPlain + half + "rate = 0.02\ndeposit = \"Mask\"\n"),
        Contains("step[0].deposit = \"Mask\": 500e22 atoms per cm^3 make an ideal mask and no film"));
}

TEST_CASE("ion_beam: of what comes down a film grows by what sticks") {
    for (const char* key : {"redeposition_fraction", "redeposition_rate"}) {
        const auto growth = [&](const char* sticking, const char* material) {
            const Recipe recipe = with_mask("SiO2", kBeam + "rate = 0.02\n" + key + " = 0.5\n" + sticking);
            const Model model = make_model(recipe.steps.front(), recipe.materials, recipe.domain);
            const std::vector<double> flux{0.0, 0.0, 1.0};
            return model.speed({*material_id(recipe.materials, material), flux});
        };
        const char* some = "redeposition_sticking = { Si = 0.25, SiO2 = 0, default = 1 }\n";
        REQUIRE(growth("", "Si") > 0.0);
        CHECK(growth(some, "Si") == Approx(0.25 * growth("", "Si")));
        CHECK(growth(some, "SiO2") == 0.0);
        CHECK(growth(some, "PolySi") == growth("", "PolySi"));
    }
}

TEST_CASE("a note tells where a redeposition rate makes matter") {
    const auto notes = [](const std::string& keys) {
        std::vector<std::string> notes = notes_on(with_mask("Mask", kBeam + keys));
        std::erase_if(notes, [](const std::string& note) { return note.find("redeposition") == note.npos; });
        return notes;
    };
    const std::string rate = "rate = { Si = 0.02, PolySi = 0.02 }\n";
    // A flat wafer's mean yield at 100 eV: sqrt(100) - sqrt(20) = 5.53.
    const auto many = notes(rate + "redeposition_rate = 0.02\n");
    REQUIRE(many.size() == 3);
    CHECK_THAT(many[0], Contains("step[0].redeposition_rate creates matter: where the beam hits Si, 5."));
    CHECK_THAT(many[1], Contains("hits PolySi, 5."));
    CHECK_THAT(many[2], Contains("hits Mask, atoms redeposit and none are sputtered"));
    CHECK(notes(rate + "redeposition_rate = 0.003\n").size() == 1);  // the mask emits atoms and loses none
    CHECK(notes(rate + "redeposition_fraction = 1.0\n").empty());
}
