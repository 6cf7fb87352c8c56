#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "app/models/chemistry.hpp"
#include "app/models/model.hpp"
#include "app/process/estimate/blanket.hpp"

// The speed of an open flat wafer, which is known in closed form.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

Recipe blanket_recipe(const std::string& step, const std::string& time_unit = "s") {
    return parse_recipe(
        "[domain]\nextent = [2.0, 1.0]\ngrid_spacing = 0.1\nlength_unit = \"um\"\ntime_unit = \"" +
            time_unit +
            "\"\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"SiO2\"\nthickness = 0.2\n"
            "[[layer]]\nmaterial = \"Mask\"\nthickness = 0.2\n[[step]]\nduration = 2.0\n" +
            step,
        "blanket.toml");
}

double rate_on(const Recipe& recipe, const char* material) {
    for (const StepMaterials& here : materials_by_step(recipe))
        for (const BlanketRate& at : blanket_rates(here))
            if (at.material == *material_id(recipe.materials, material)) {
                CHECK(at.unknown.empty());
                return at.rate;
            }
    return NAN;
}

}  // namespace

TEST_CASE("a flat wafer moves at the rate of the recipe, where one particle arrives") {
    const Recipe one =
        blanket_recipe("model = \"single_particle\"\nrate = { Si = -0.1, SiO2 = -0.02 }\nsticking = 0.3\n");
    CHECK(rate_on(one, "Si") == Approx(-0.1));
    CHECK(rate_on(one, "SiO2") == Approx(-0.02));
    CHECK(rate_on(one, "Mask") == 0.0);
    CHECK_THAT(blanket_table(one), Contains("nm/s") &&
                                       Contains("etches Si: -100, SiO2: -20; Mask stands still") &&
                                       Contains("selectivity Si : SiO2 5"));
    const Recipe grows =
        blanket_recipe("model = \"isotropic\"\nrate = 0.00487\ndeposit = \"Polymer\"\n", "min");
    CHECK_THAT(blanket_table(grows), Contains("nm/min") &&
                                         Contains("grows Polymer on Si: +4.87, SiO2: +4.87") &&
                                         Contains("nothing is etched"));
    const Recipe both = blanket_recipe("model = \"directional\"\ndirectional = -0.1\nisotropic = -0.05\n");
    CHECK(rate_on(both, "Si") == Approx(-0.15));
}

TEST_CASE(
    "a model's own defaults etch its own material at a speed that such plasmas have, or it asks for a rate") {
    struct Own {
        std::string material, keys;
        double slowest, fastest;  // nm/min
    };
    // Models for silicon reach micrometres a minute; models for oxide a few hundred nanometres.
    const std::map<std::string, Own> own = {
        {"sf6_o2", {"Si", "", 500.0, 5000.0}},
        {"cf4_o2", {"Si", "", 100.0, 5000.0}},
        {"hbr_o2", {"Si", "", 50.0, 1000.0}},
        {"fluorocarbon", {"SiO2", "deposit = \"Polymer\"\n", 100.0, 800.0}},
    };
    for (const std::string& name : model_names()) {
        if (!find_model(name)->make) continue;  // a geometric model
        INFO(name);
        const auto found = own.find(name);
        const Own here = found == own.end() ? Own{"Si", "", 0.0, 0.0} : found->second;
        const auto recipe = [&] {
            return parse_recipe(
                fmt::format(
                    "[domain]\nextent = [2.0]\ngrid_spacing = 0.1\nlength_unit = \"nm\"\ntime_unit = \"min\"\n"
                    "[[layer]]\nmaterial = \"{}\"\n[[step]]\nmodel = \"{}\"\nduration = 1.0\n{}",
                    here.material, name, here.keys),
                "own.toml");
        };
        if (found == own.end()) {
            CHECK_THROWS_WITH(recipe(), Contains("missing"));
            continue;
        }
        const double rate = rate_on(recipe(), here.material.c_str());
        CHECK(rate < -here.slowest);
        CHECK(rate > -here.fastest);
    }
    CHECK_THAT(
        blanket_table(parse_recipe(
            "[domain]\nextent = [2.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"SiO2\"\n[[step]]\nmodel = \"fluorocarbon\"\n"
            "duration = 1.0\ndeposit = \"Polymer\"\nremoval_yield = 0.0361\n",
            "buried.toml")),
        Contains("grows Polymer on SiO2") && Contains("nothing is etched"));
}

TEST_CASE("a flat wafer's coverages are in steady state and its ions have their mean yield") {
    // theta = k/(k + 1) at flux 1; yield scale (sqrt(E) - sqrt(20)) at exactly 100 eV and normal incidence.
    const std::string law =
        "model = \"formula\"\nspecies = [{ name = \"F\", sticking = \"0.2*(1 - theta)\" }, { name = \"ion\", kind = \"ion\", "
        "energy = 100.0, energy_spread = 0.0, source_exponent = 1e5, yields = [{ name = \"y\", energy = \"sqrt(E) - sqrt(20)\", "
        "scale = { Si = 0.03, default = 0.0 } }] }]\nparameters = { k = 0.3 }\ncoverages = { theta = \"k*F/(k*F + 1)\" }\n"
        "rate = \"-0.1*F*(1 - theta) - 0.02*ion_y\"\n";
    const double chemical = -0.1 / 1.3, sputtered = -0.02 * 0.03 * (10.0 - std::sqrt(20.0));
    CHECK(rate_on(blanket_recipe(law), "Si") == Approx(chemical + sputtered).epsilon(1e-3));
    CHECK(rate_on(blanket_recipe(law), "Mask") == Approx(chemical).epsilon(1e-6));
    // A slow coverage does not settle within the step: theta = 1 - exp(-0.5 t) at t = 2.
    const std::string slow =
        "model = \"formula\"\nspecies = [{ name = \"F\" }]\ncoverage_rates = { theta = \"0.5*(1 - theta)\" }\nrate = \"-theta\"\n";
    CHECK(rate_on(blanket_recipe(slow), "Si") == Approx(std::exp(-1.0) - 1.0).epsilon(1e-6));
    // ALD by Langmuir, as in a pulse of one part: theta = 1 - exp(-s Gamma pulse / s_0), with 0.1 1.0 1.0 /
    // 0.2 = 0.5. The rate is the growth over the cycle of 2 s.
    const std::string ald =
        "model = \"ald\"\ngrowth_per_cycle = 0.001\npulse = 1.0\npurge = 1.0\nprecursor_flux = 1.0\nsticking = 0.1\n"
        "evaporation = 0.0\nsites = 0.2\nparts = 4\ndeposit = \"Al2O3\"\n";
    CHECK(rate_on(blanket_recipe(ald), "Si") == Approx(0.001 / 2.0 * (1.0 - std::exp(-0.5))).epsilon(1e-6));
}

TEST_CASE("a stop that no step can meet in its duration is noted, and one that it may meet is not") {
    // The wafer's lowest point starts at z = 0, and a step lasts 2 s.
    const auto notes = [](const std::string& step) {
        std::string all;
        for (const std::string& note : unmet_stops(blanket_recipe(step))) all += note + "\n";
        return all;
    };
    const std::string etch = "model = \"isotropic\"\nrate = -0.3\n",
                      grow = "model = \"isotropic\"\nrate = 0.1\ndeposit = \"W\"\n",
                      metrology = "[metrology]\nmeasures = [\"depth\", \"film\"]\n";
    CHECK(
        notes(etch + "stop_depth = 1.0\n") ==
        "step[0].stop_depth never ends the step: at blanket rates the steps up to its end reach a depth of 0.6 um "
        "at most\n");
    CHECK(notes(etch + "stop_depth = 0.6\n").empty());
    CHECK_THAT(notes(etch + "stop = \"depth > 1\"\n" + metrology),
               Contains("step[0].stop never ends the step"));
    CHECK(notes(etch + "stop = \"depth > 1\"\n" + metrology + "mask_bottom = 0.5\n").empty());
    CHECK(notes(etch + "stop = \"depth < 1\"\n" + metrology).empty());
    CHECK_THAT(notes(grow + "stop_depth = 1.0\n"), Contains("reach a depth of 0 um at most"));
    CHECK_THAT(
        notes(grow + "stop = \"bare(Si) > 0.9\"\n"),
        Contains("step[0].stop ends the step at once or never: nothing that could cover Si is etched"));
    CHECK_THAT(notes("model = \"isotropic\"\nrate = { Si = -0.3 }\nstop = \"bare(Si) > 0.9\"\n"),
               Contains("nothing that could cover Si is etched"));
    const auto fill = [&](const char* height) {
        return notes(etch + "[[step]]\nmodel = \"fill\"\nmaterial = \"W\"\nheight = " + height + "\n");
    };
    CHECK(fill("-0.7") == "step[1].height fills nothing: no place of the wafer lies below z = -0.6\n");
    CHECK(fill("-0.5").empty());
    CHECK(notes(etch + "stop_material = \"Si\"\n").empty());
    CHECK_THAT(notes(grow + "stop_thickness = 0.4\n"), Contains("grow 0.2 um at most"));
    CHECK_THAT(notes(grow + "stop = \"film_top > 0.4\"\n" + metrology), Contains("grow 0.2 um at most"));
    CHECK(notes(grow + "stop_thickness = 0.2\n").empty());
    // Earlier steps count, and in a loop all rounds of all its steps.
    CHECK(notes(etch + "[[step]]\nduration = 2.0\n" + etch + "stop_depth = 1.0\n").empty());
    const auto loop = [&](const char* rounds) {
        return notes(etch + "[[step]]\nrepeat = " + rounds + "\n[[step.steps]]\nduration = 2.0\n" + etch +
                     "stop_depth = 2.0\n[[step.steps]]\nduration = 1.0\n" + etch);
    };
    CHECK_THAT(loop("1"), Contains("step[1].steps[0].stop_depth") && Contains("1.2 um at most"));
    CHECK(loop("2").empty());
    // Ions may etch facets faster, and rates may depend on place and time.
    CHECK(notes("model = \"formula\"\nrate = \"-0.1*time\"\nstop_depth = 5.0\n").empty());
    CHECK(notes("model = \"ion_beam\"\nrate = 0.1\nstop_depth = 5.0\n").empty());
    // A cut may lower the surface anywhere.
    CHECK(
        notes(
            etch +
            "[[step]]\nmodel = \"cut\"\nmaterials = [\"Si\"]\nshape = \"box\"\nsize = [1.0, 0.5]\ndepth = 3.0\n"
            "[[step]]\nduration = 2.0\n" +
            etch + "stop_depth = 5.0\n")
            .empty());
}

TEST_CASE("check says which law has no value on a flat wafer") {
    CHECK_THAT(blanket_table(blanket_recipe(
                   "model = \"formula\"\nrate = { Si = -0.1, default = \"sqrt(-1 + 0*time)\" }\n")),
               Contains("etches Si: -100") && Contains("SiO2: no rate: "));
}
