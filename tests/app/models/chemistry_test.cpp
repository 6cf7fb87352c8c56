#include "app/models/chemistry.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/models/crystal.hpp"
#include "app/recipe/step_model.hpp"
#include "flux/yield.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

const std::string kSilicon = R"([domain]
extent = [4.0, 4.0]
grid_spacing = 0.1
boundary = "periodic"
[[layer]]
material = "Si"
[[step]]
)";

struct Chemistry {
    Recipe recipe;
    Model model;
    SurfacePoint point(const char* material, std::span<const double> flux,
                       std::span<const double> theta = {}) const {
        return {*material_id(recipe.materials, material), flux, Vec3::UnitZ(), true, theta};
    }
    // Lets the coverages settle under these fluxes and returns the speed.
    double settled(const char* material, const std::vector<double>& flux, std::vector<double>& theta,
                   double time = 0.0) const {
        model.coverages.react(point(material, flux, theta), time, theta);
        return model.speed(point(material, flux, theta));
    }
};

Chemistry chemistry(const std::string& keys) {
    Chemistry result{parse_recipe(kSilicon + keys, "step.toml"), {}};
    result.model = make_model(result.recipe.steps.at(0), result.recipe.materials, result.recipe.domain);
    return result;
}

}  // namespace

TEST_CASE("passivated coverages are the steady state, in every limit too") {
    for (const double ge : {3.0, 1e-6, 1e6})
        for (const double gp : {0.5, 1e-9, 1e7})
            for (const double le : {2.0, 1e-5})
                for (const double lp : {0.04, 30.0}) {
                    const auto theta = competing_coverages<2>({{{ge, le}, {gp, lp}}});
                    const double a = le / ge, b = lp / gp;
                    CHECK(theta[0] == Approx(1.0 / (1.0 + a * (1.0 + 1.0 / b))).epsilon(1e-12));
                    CHECK(theta[1] == Approx(1.0 / (1.0 + b * (1.0 + 1.0 / a))).epsilon(1e-12));
                }
    using Two = std::array<double, 2>;
    CHECK(competing_coverages<2>({{{0, 2}, {0, 3}}}) == Two{0, 0});
    CHECK(competing_coverages<2>({{{6, 2}, {0, 3}}}) == Two{0.75, 0});  // no passivant: 1 / (1 + a)
    CHECK(competing_coverages<2>({{{6, 2}, {0, 0}}}) == Two{0.75, 0});
    CHECK(competing_coverages<2>({{{0, 2}, {1, 3}}}) == Two{0, 0.25});
    CHECK(competing_coverages<2>({{{6, 2}, {1, 0}}}) == Two{0, 1});  // what never leaves takes every site
    CHECK(competing_coverages<2>({{{6, 0}, {1, 3}}}) == Two{1, 0});
    CHECK(competing_coverages<2>({{{0, 0}, {0, 0}}}) == Two{0, 0});
    CHECK(competing_coverages<2>({{{3, 0}, {1, 0}}}) == Two{0.75, 0.25});
}

TEST_CASE("adsorbates that compete for sites are in steady state, in every limit too") {
    for (const double g : {3.0, 0.0, 1e-9, 1e9})
        for (const double l : {2.0, 1e-7, 1e7}) {
            const std::array<Adsorbate, 3> all{{{g, 2.0}, {5.0, l}, {0.7, 0.3}}};
            const auto theta = competing_coverages(all);
            const double sites = 1.0 - theta[0] - theta[1] - theta[2];
            for (std::size_t k = 0; k < 3; ++k) {
                const double balance = all[k].gain * sites - all[k].loss * theta[k];
                // Rounding: the free sites are 1 less three coverages.
                CHECK(std::abs(balance) <= 1e-14 * all[k].gain + 1e-12 * all[k].loss * theta[k]);
            }
        }
    using Three = std::array<double, 3>;
    CHECK(competing_coverages<3>({{{0, 0}, {0, 1}, {0, 0}}}) == Three{0, 0, 0});
    CHECK(competing_coverages<3>({{{6, 2}, {0, 0}, {0, 1}}}) == Three{0.75, 0, 0});
    CHECK(competing_coverages<3>({{{6, 2}, {1, 0}, {2, 1}}}) ==
          Three{0, 1, 0});  // a species that never leaves takes all
    CHECK(competing_coverages<3>({{{3, 0}, {1, 0}, {2, 1}}}) == Three{0.75, 0.25, 0});
    CHECK(competing_coverages<3>({{{1e3, 1e-320}, {1, 1}, {0, 0}}}) == Three{1, 0, 0});
}

TEST_CASE("cf4_o2 on a flat wafer etches at the formula's rate: silicon, silicon-germanium and mask") {
    for (const bool beta : {true, false}) {
        const Chemistry etch = chemistry(std::string("model = \"cf4_o2\"\nduration = 1\ncoverage_beta = ") +
                                         (beta ? "true\n" : "false\n"));
        CHECK(flux_names(etch.model.species) ==
              std::vector<std::string>{"etchant", "oxygen", "polymer", "ion", "ion_sputter", "ion_enhanced",
                                       "ion_oxygen_removal", "ion_polymer_removal"});
        // Ions at normal incidence and exactly 100 eV.
        const double root = std::sqrt(100.0), removal = 3.0 * (root - std::sqrt(10.0));
        struct Material {
            const char* name;
            double x, a_sp, a_ie, rho;
        };
        for (const Material& m : {Material{"Si", 0.0, 0.0337, 7.0, 5.02}, {"SiGe", 0.3, 0.03, 6.5, 4.8}}) {
            const double y_sp = m.a_sp * (root - std::sqrt(20.0)), y_ie = m.a_ie * (root - std::sqrt(15.0));
            std::vector<double> theta(3, 0.0);
            const double speed =
                etch.settled(m.name, {1.0, 1.0, 1.0, 1.0, y_sp, y_ie, removal, removal}, theta);
            const double k = 300.0 * std::exp(0.4675 * m.x);
            const double f = (beta ? 0.7 : 1.0) * 1800.0 / (k + 2.0 * 12.0 * y_ie),
                         o = 100.0 /
                             (0.04 + 12.0 * removal + (m.x > 0.0 ? (beta ? 0.3 : 1.0) * 1800.0 : 0.0)),
                         c = 100.0 / (12.0 * removal + (beta ? 0.3 : 1.0) * 100.0);
            const double sum = 1.0 + f + o + c;
            CHECK(theta[0] == Approx(f / sum).epsilon(1e-9));
            CHECK(theta[1] == Approx(o / sum).epsilon(1e-9));
            CHECK(theta[2] == Approx(c / sum).epsilon(1e-9));
            const double nm_per_s = (k * f / sum / 4.0 + 12.0 * y_sp + f / sum * 12.0 * y_ie) / m.rho;
            CHECK(speed == Approx(-1e-3 * nm_per_s).epsilon(1e-9));  // um/s
            const auto sticks = [&](std::size_t s) {
                return etch.model.sticking(s, etch.point(m.name, {}, theta));
            };
            CHECK(sticks(0) == Approx(0.7 / sum + 0.3 * o / sum).epsilon(1e-9));
            CHECK(sticks(1) == Approx(1.0 / sum + 0.3 * c / sum).epsilon(1e-9));
            CHECK(sticks(2) == Approx(1.0 / sum + 0.3 * o / sum).epsilon(1e-9));
            CHECK(sticks(3) == 0.0);
        }
        std::vector<double> theta(3, 0.0);
        const double mask = 0.0139 * (root - std::sqrt(20.0));
        CHECK(etch.settled("Mask", {1.0, 1.0, 1.0, 1.0, mask, 0.0, removal, removal}, theta) ==
              Approx(-1e-3 * mask * 12.0 / 500.0).epsilon(1e-9));
    }
}

TEST_CASE("cf4_o2: what selects silicon-germanium is the oxygen that fluorine takes off it") {
    // A remote plasma: no ions are traced.
    const auto rate = [](const char* material, const std::string& keys) {
        const Chemistry etch = chemistry(
            "model = \"cf4_o2\"\nduration = 1\nion_flux = 0\ncoverage_beta = false\n"
            "etchant_flux = 500\npolymer_flux = 5\n" +
            keys);
        CHECK(etch.model.species.size() == 3);
        std::vector<double> theta(3, 0.0);
        return -etch.settled(material, {1.0, 1.0, 1.0}, theta);
    };
    const std::string oxygen = "oxygen_flux = 50\n";
    // By hand: F 500/300 and 500/345.2, O 50/0.04 and 50/500.04, C 5/50.
    CHECK(rate("Si", oxygen) ==
          Approx(1e-3 * 75.0 * (500.0 / 300.0) / (1.1 + 500.0 / 300.0 + 1250.0) / 5.02).epsilon(1e-9));
    const double k = 300.0 * std::exp(0.4675 * 0.3);
    CHECK(rate("SiGe", oxygen) ==
          Approx(1e-3 * 0.25 * k * (500.0 / k) / (1.1 + 500.0 / k + 50.0 / 500.04) / 4.8).epsilon(1e-9));
    CHECK(rate("SiGe", oxygen) / rate("Si", oxygen) > 400.0);
    // Without oxygen the polymer never leaves and stops both; without either only k_sigma differs.
    CHECK(rate("Si", "oxygen_flux = 0\n") == 0.0);
    CHECK(rate("SiGe", "oxygen_flux = 0\n") == 0.0);
    const auto bare = [](const char* material) {
        const Chemistry etch =
            chemistry("model = \"cf4_o2\"\nduration = 1\nion_flux = 0\noxygen_flux = 0\npolymer_flux = 0\n");
        std::vector<double> theta(3, 0.0);
        return -etch.settled(material, {1.0, 1.0, 1.0}, theta);
    };
    CHECK(bare("Si") == Approx(1e-3 * 75.0 / (1.0 + 300.0 / 1260.0) / 5.02).epsilon(1e-9));
    CHECK(bare("SiGe") == Approx(1e-3 * 0.25 * k / (1.0 + k / 1260.0) / 4.8).epsilon(1e-9));
    // No etchant at all: nothing happens.
    const Chemistry none = chemistry("model = \"cf4_o2\"\nduration = 1\nion_flux = 0\netchant_flux = 0\n");
    std::vector<double> theta(3, 0.0);
    CHECK(none.settled("Si", {1.0, 1.0, 1.0}, theta) == 0.0);
    CHECK(theta[0] == 0.0);
}

TEST_CASE("sf6_o2 on a flat wafer etches at the formula's rate, silicon and mask") {
    for (const bool beta : {true, false}) {
        const Chemistry etch = chemistry(std::string("model = \"sf6_o2\"\nduration = 1\ncoverage_beta = ") +
                                         (beta ? "true\n" : "false\n"));
        // Ions at normal incidence and exactly 100 eV: the mean yields of a flat wafer.
        const double root = std::sqrt(100.0), y_sp = 0.0337 * (root - std::sqrt(20.0)),
                     y_ie = 7.0 * (root - std::sqrt(15.0)), y_p = 3.0 * (root - std::sqrt(10.0));
        CHECK(flux_names(etch.model.species) == std::vector<std::string>{"ion", "ion_sputter", "ion_enhanced",
                                                                         "ion_removal", "etchant", "oxygen"});
        std::vector<double> theta(2, 0.0);
        const double speed = etch.settled("Si", {1.0, y_sp, y_ie, y_p, 1.0, 1.0}, theta);
        const double a = (300.0 + 2.0 * y_ie * 10.0) / ((beta ? 0.7 : 1.0) * 4500.0),
                     b = (0.04 + y_p * 10.0) / 800.0;
        CHECK(theta[0] == Approx(1.0 / (1.0 + a * (1.0 + 1.0 / b))).epsilon(1e-6));
        CHECK(theta[1] == Approx(1.0 / (1.0 + b * (1.0 + 1.0 / a))).epsilon(1e-6));
        const double nm_per_s = (75.0 * theta[0] + y_sp * 10.0 + theta[0] * y_ie * 10.0) / 5.02;
        CHECK(speed == Approx(-1e-3 * nm_per_s).epsilon(1e-6));  // um/s
        CHECK(etch.model.sticking(1, etch.point("Si", {}, theta)) ==
              Approx(0.7 * (1.0 - theta[0] - theta[1])));
        CHECK(etch.model.sticking(2, etch.point("Si", {}, theta)) == Approx(1.0 - theta[0] - theta[1]));
        // The mask is only sputtered.
        const double mask = 0.0139 * (root - std::sqrt(20.0));
        CHECK(etch.settled("Mask", {1.0, mask, y_ie, y_p, 1.0, 1.0}, theta) ==
              Approx(-1e-3 * mask * 10.0 / 500.0).epsilon(1e-6));
    }
    const Chemistry nanometres = [] {
        Chemistry result{parse_recipe(R"([domain]
extent = [4.0, 4.0]
grid_spacing = 0.1
length_unit = "nm"
time_unit = "min"
[[layer]]
material = "Si"
[[step]]
model = "hbr_o2"
duration = 1
)",
                                      "step.toml"),
                         {}};
        result.model = make_model(result.recipe.steps.at(0), result.recipe.materials, result.recipe.domain);
        return result;
    }();
    std::vector<double> theta(2, 0.0);
    CHECK(nanometres.settled("Si", {1, 0, 0, 0, 1, 0},
                             theta) ==  // no ions, no oxygen: thermal etching in nm/min
          Approx(-60.0 * 75.0 / 5.02 / (1.0 + 300.0 / (0.1 * 4500.0))).epsilon(1e-9));
}

TEST_CASE("fluorocarbon coverages are the steady state, and decide between polymer and etching") {
    const FluorocarbonCoverage theta = fluorocarbon_coverage({.etchant = 450,
                                                              .etchant_on_polymer = 300,
                                                              .polymer = 2.0,
                                                              .polymer_removal = 12,
                                                              .polymer_loss = 1,
                                                              .enhanced = 20,
                                                              .evaporation = 3});
    CHECK(theta.etchant_on_polymer == Approx(300.0 / 312.0).epsilon(1e-12));
    CHECK(theta.polymer == Approx(2.0 / (12.0 * 300.0 / 312.0 + 1.0)).epsilon(1e-12));
    CHECK(theta.etchant == Approx(450.0 * (1.0 - theta.polymer) / (20.0 + 3.0 + 450.0)).epsilon(1e-12));
    CHECK(fluorocarbon_coverage({.polymer = 5.0}).polymer == 1.0);
    const FluorocarbonCoverage bare = fluorocarbon_coverage({});
    CHECK(bare.etchant == 0.0);
    CHECK(bare.polymer == 0.0);
    CHECK(bare.etchant_on_polymer == 0.0);

    const Chemistry etch = chemistry(
        "model = \"fluorocarbon\"\nduration = 1\ndeposit = \"Polymer\"\nenhanced_yield = { Si = 0.0 }\n");
    CHECK_THROWS_WITH(chemistry("model = \"fluorocarbon\"\nduration = 1\n"),
                      Catch::Contains("deposit: missing") && Catch::Contains("deposit = \"Polymer\""));
    std::vector<double> sites(3, 0.0);
    const double shadow = etch.settled("SiO2", {0, 0, 0, 0, 0.1, 1.0}, sites);  // polymer, no ions
    CHECK(sites[1] == 1.0);
    CHECK(shadow == Approx(1e-3 * 100.0 * 0.26 / 2.2).epsilon(1e-9));
    const double y_ie = 0.0361 * (10.0 - 2.0), y_sp = 0.0139 * (10.0 - std::sqrt(18.0));
    const double open = etch.settled("SiO2", {1, y_sp, y_ie, y_ie, 1.0, 0.02}, sites);
    REQUIRE(sites[1] < 1.0);
    const double evaporation = 0.0027895 * 500.0 * std::exp(-0.168 / (8.617333262e-5 * 300.0));
    CHECK(open ==
          Approx(-1e-3 * (sites[0] * (evaporation + 56.0 * y_ie) + (1.0 - sites[0]) * 56.0 * y_sp) / 2.2)
              .epsilon(1e-6));
}

TEST_CASE("a table by material changes what it names in the key's default") {
    const auto yield = [](const std::string& keys, const char* material) {
        const Chemistry etch = chemistry("model = \"sf6_o2\"\nduration = 1\n" + keys);
        return etch.model.species.at(0).yields.at(0).scale.at(
            static_cast<std::size_t>(*material_id(etch.recipe.materials, material)));
    };
    const std::string silicon = "sputter_yield = { Si = 0.05 }\n";
    CHECK(yield(silicon, "Si") == 0.05);
    CHECK(yield(silicon, "Mask") == yield("", "Mask"));
    CHECK(yield("", "Mask") != yield("", "Si"));
    CHECK(yield("sputter_yield = { Si = 0.05, default = 0.02 }\n", "Mask") == 0.02);
}

TEST_CASE("ion_beam: a plane tilted by theta etches by the yield curve, a flat wafer at the blanket rate") {
    const double threshold = 20.0, energy = 100.0, root = std::sqrt(energy) - std::sqrt(threshold);
    const auto y = [](double c) { return (1.0 + 9.3 * (1.0 - c * c)) * c; };
    for (const double tilt : {0.0, 35.0, 60.0}) {
        // Ions of one energy and direction.
        const Chemistry beam = chemistry(
            "model = \"ion_beam\"\nduration = 1\nrate = { Si = 0.5 }\nion_exponent = 1e6\n"
            "ion_energy_spread = 0\ntilt_deg = " +
            std::to_string(tilt) + "\n");
        const flux::Species& ion = beam.model.species.at(0);
        const double c = std::cos(tilt * std::acos(-1.0) / 180.0);
        CHECK(-ion.beam.z() == Approx(c));
        REQUIRE(ion.yields.size() == 1);
        CHECK(beam.model.speed(beam.point("Si", std::vector<double>{1.0, root * y(c)})) ==
              Approx(-0.5).epsilon(1e-4));
        CHECK(beam.model.speed(beam.point("Mask", std::vector<double>{1.0, root * y(c)})) == 0.0);
    }
    const Chemistry tabled = chemistry(
        "model = \"ion_beam\"\nduration = 1\nrate = 0.5\nion_energy_spread = 0\nyield_table = [1, 3, 0]\n");
    CHECK(flux::angular_factor(tabled.model.species.at(0).yields.at(0), std::cos(std::acos(-1.0) / 8.0)) ==
          Approx(2.0));
    const std::string keys = "duration = 1\nmodel = \"ion_beam\"\nrate = { Si = 1 }\ntilt_deg = 20\n";
    CHECK_THROWS_WITH(chemistry(keys + "yield_table = [1]\n"), Catch::Contains("2 values or more"));
    CHECK_THROWS_WITH(chemistry(keys + "yield_table = [1, -1]\n"), Catch::Contains("must not be negative"));
    std::string mirrored = kSilicon;
    mirrored.replace(mirrored.find("periodic"), 8, "reflective");
    CHECK_THROWS_WITH(parse_recipe(mirrored + keys, "step.toml"), Catch::Contains("would mirror it"));
    CHECK_NOTHROW(parse_recipe(mirrored + keys + "rotating = true\n", "step.toml"));
}

TEST_CASE("teos: V is rate flux^order, and sticking falls with the flux as the order says") {
    const Chemistry one = chemistry(
        "model = \"teos\"\nduration = 1\ndeposit = \"SiO2\"\n"
        "precursors = [{ rate = 2, sticking = 0.2, order = 2 }]\n");
    std::vector<double> theta(1, 0.0);
    CHECK(one.settled("Si", {1.0}, theta) == 2.0);
    CHECK(one.model.sticking(0, one.point("Si", {}, theta)) == 0.2);
    CHECK(one.settled("Si", {0.5}, theta) == 0.5);
    CHECK(one.model.sticking(0, one.point("Si", {}, theta)) == Approx(0.1));
    const Chemistry two = chemistry(
        "model = \"teos\"\nduration = 1\ndeposit = \"SiO2\"\n"
        "precursors = [{ rate = 2 }, { rate = 1, order = 3 }]\n");
    std::vector<double> both(2, 0.0);
    CHECK(two.settled("Si", {0.5, 0.5}, both) == 1.125);
}

TEST_CASE("ald: coverage follows its differential equation, and growth a cycle saturates with the pulse") {
    const double gain = 0.8, loss = 0.1, sites = 2.0;
    double theta = 0.0;
    for (int n = 0; n < 100000; ++n) theta += 3e-5 * (gain * (1.0 - theta) - loss * theta) / sites;
    CHECK(pulsed_coverage(0.0, gain, loss, sites, 3.0) == Approx(theta).epsilon(1e-4));
    CHECK(pulsed_coverage(pulsed_coverage(0.0, gain, loss, sites, 1.0), gain, loss, sites, 2.0) ==
          Approx(pulsed_coverage(0.0, gain, loss, sites, 3.0)).epsilon(1e-12));
    CHECK(pulsed_coverage(0.3, 0.0, 0.0, sites, 3.0) == 0.3);

    double before = 0.0, gained = 1.0;
    for (const char* pulse : {"0.1", "0.2", "0.4", "0.8", "6.4"}) {
        const Chemistry film =
            chemistry(std::string("model = \"ald\"\nduration = 1\ndeposit = \"HfO2\"\npurge = 1\n"
                                  "growth_per_cycle = 1e-4\nprecursor_flux = 10\npulse = ") +
                      pulse + "\n");
        std::vector<double> covered(1, 0.0);
        const double speed = film.settled("Si", {1.0}, covered, film.model.coverages.pulse);
        const double cycle = speed * (film.model.coverages.pulse + 1.0);
        CHECK(cycle == Approx(1e-4 * (1.0 - std::exp(-10.0 * film.model.coverages.pulse))).epsilon(1e-9));
        CHECK(cycle >= before);
        gained = cycle - before;
        before = cycle;
    }
    CHECK(gained < 1e-7);
    CHECK(before == Approx(1e-4).epsilon(1e-6));
}

TEST_CASE("epitaxy has rates of its own: slowest on <111>, and what is given counts") {
    const auto rates = [](const std::string& keys) {
        const Chemistry grow = chemistry(
            "model = \"epitaxy\"\nduration = 1\nmaterial = \"Si\"\ndeposit = \"SiGe\"\naxis_100 = [1, 0, 0]\n"
            "axis_010 = [0, 1, 0]\n" +
            keys);
        std::vector<double> result;
        for (const Vec3& face : {Vec3(0, 0, 1), Vec3(1, 1, 0), Vec3(1, 1, 1), Vec3(3, 1, 1)}) {
            SurfacePoint point = grow.point("SiGe", {});
            point.normal = face.normalized();
            result.push_back(grow.model.speed(point));
            point.material = *material_id(grow.recipe.materials, "SiO2");
            CHECK(grow.model.speed(point) == 0.0);
        }
        return result;
    };
    const auto are = [](const std::vector<double>& rates, const std::vector<double>& expected) {
        for (std::size_t k = 0; k < 4; ++k) CHECK(rates[k] == Approx(expected[k]).epsilon(1e-12));
    };
    are(rates(""), {1.0, 0.75, 0.5, 0.75});
    are(rates("r100 = 2\n"), {2.0, 1.5, 1.0, 1.5});
    are(rates("r100 = 2\nr111 = 0.8\n"), {2.0, 1.4, 0.8, 1.4});  // rates of configs/fin_epitaxy.toml
    are(rates("r111 = 0\nr110 = 0.3\nr311 = \"auto\"\n"), {1.0, 0.3, 0.0, 0.5});
    CHECK_THROWS_WITH(rates("r111 = -1\n"), Catch::Contains("step[0].r111 = -1: must be at least 0"));
    CHECK_THROWS_WITH(chemistry("model = \"wet\"\nduration = 1\nmaterial = \"Si\"\nr100 = 1\n"),
                      Catch::Contains("step[0].r110: missing"));
}

TEST_CASE("a crystal's four families of faces move at their rates, in any orientation") {
    const CrystalRates rates{0.797, 1.455, 0.005, 1.436};
    for (const CrystalAxes& axes :
         {crystal_axes(Vec3::UnitX(), Vec3::UnitY()), crystal_axes({1, 1, 0}, {-1, 1, 0}),
          crystal_axes({1, 2, 3}, {0, 1, 0})}) {
        const auto face = [&](double a, double b, double c) {
            return crystal_rate((a * axes[0] + b * axes[1] + c * axes[2]).normalized(), axes, rates);
        };
        for (const double s : {1.0, -1.0}) {
            CHECK(face(s, 0, 0) == Approx(0.797));
            CHECK(face(0, 0, s) == Approx(0.797));
            CHECK(face(s, 1, 0) == Approx(1.455));
            CHECK(face(0, 1, s) == Approx(1.455));
            CHECK(face(1, s, 1) == Approx(0.005));
            CHECK(face(1, 3 * s, 1) == Approx(1.436));
            CHECK(face(1, 1, 3 * s) == Approx(1.436));
        }
        // Continuous: no jump between the two branches.
        for (int n = 0; n < 400; ++n) {
            const double t = n * 0.01;
            CHECK(std::abs(face(std::cos(t), std::sin(t), 0.3) -
                           face(std::cos(t + 1e-6), std::sin(t + 1e-6), 0.3)) < 1e-4);
        }
    }
    // The bound holds for every normal, also between those at which it was evaluated.
    const CrystalAxes axes = crystal_axes({1, 1, 0}, {-1, 1, 0});
    const CrystalBound bound = crystal_bound(axes, rates);
    const auto hamiltonian = [&](const Vec3& p) { return p.norm() * crystal_rate(p, axes, rates); };
    for (int i = 0; i < 3000; ++i) {
        const double z = -1.0 + i / 1500.0, phi = 2.399963 * i;
        const Vec3 n(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
        CHECK(std::abs(crystal_rate(n, axes, rates)) <= bound.sum);
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3 aside = n + 1e-3 * Vec3::Unit(axis);
            CHECK(std::abs(hamiltonian(aside) - hamiltonian(n)) <= 1e-3 * bound.by_axis[axis]);
        }
    }
    const Chemistry wet = chemistry(
        "model = \"wet\"\nduration = 1\nmaterial = \"Si\"\nr100 = 2\nr110 = 1\nr111 = 1\nr311 = 1\n");
    CHECK(wet.model.speed(wet.point("Si", {})) == -2.0);
    CHECK(wet.model.speed(wet.point("SiO2", {})) == 0.0);
    CHECK(wet.model.depends_on_normal);
    const Chemistry grown = chemistry(
        "model = \"epitaxy\"\nduration = 1\nmaterial = \"Si\"\nr100 = 1\nr110 = 1\nr111 = 0\nr311 = "
        "1\ndeposit = \"SiGe\"\n");
    CHECK(grown.model.speed(grown.point("Si", {})) == 1.0);
    CHECK(grown.model.speed(grown.point("SiGe", {})) == 1.0);
    CHECK(grown.model.speed(grown.point("SiO2", {})) == 0.0);
}
