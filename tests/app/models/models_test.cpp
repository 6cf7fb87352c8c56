#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <type_traits>

#include "app/recipe/step_model.hpp"
#include "flux/yield.hpp"

using namespace sidewall;
using namespace sidewall::app;

namespace {

const std::string kWafer = R"([domain]
extent = [4.0, 4.0]
grid_spacing = 0.1
[[layer]]
material = "Si"
[[step]]
duration = 1.0
)";

struct Case {
    Recipe recipe;
    Model model;
    int id(const char* name) const { return *material_id(recipe.materials, name); }
    double speed(const char* material, std::vector<double> flux = {}, const Vec3& normal = Vec3::UnitZ(),
                 bool visible = true) const {
        return model.speed({id(material), flux, normal, visible});
    }
};

Case step(const std::string& keys) {
    Case result{parse_recipe(kWafer + keys, "step.toml"), {}};
    result.model = make_model(result.recipe.steps.at(0), result.recipe.materials, result.recipe.domain);
    return result;
}

std::string refusal(const std::string& keys) {
    try {
        step(keys);
    } catch (const RecipeError& error) {
        return error.what();
    }
    return "accepted";
}

}  // namespace

TEST_CASE("isotropic: V is the material's rate, whatever the normal") {
    const Case etch = step("model = \"isotropic\"\nrate = { Si = -0.5, SiO2 = -0.02 }\n");
    CHECK(etch.speed("Si") == -0.5);
    CHECK(etch.speed("SiO2", {}, Vec3::UnitX()) == -0.02);
    CHECK(etch.speed("Mask") == 0.0);  // a material that the table leaves out is inert
    CHECK(etch.model.species.empty());
    CHECK_FALSE(etch.model.deposit.has_value());
    CHECK(etch.model.hints.max_speed == 0.5);
    CHECK_FALSE(etch.model.visibility.has_value());

    const Case film =
        step("model = \"isotropic\"\nrate = { SiO2 = 0.25, default = 1.5 }\ndeposit = \"SiO2\"\n");
    CHECK(film.speed("Si") == 1.5);
    CHECK(film.speed("SiO2") == 0.25);
    CHECK(film.model.deposit == film.id("SiO2"));
}

TEST_CASE("directional: V follows the cosine to the source, and only where the source is seen") {
    const Case etch =
        step("model = \"directional\"\ndirectional = { Si = -1.0 }\nisotropic = { Si = -0.05 }\n");
    CHECK(etch.speed("Si") == Approx(-1.05));
    CHECK(etch.speed("Si", {}, Vec3::UnitZ(), false) == -0.05);  // in shadow
    CHECK(etch.speed("Si", {}, Vec3::UnitX()) == -0.05);         // a vertical wall
    CHECK(etch.speed("Si", {}, -Vec3::UnitZ()) == -0.05);        // an overhang's underside
    CHECK(etch.speed("Si", {}, Vec3(0.6, 0.0, 0.8)) == Approx(-0.85));
    CHECK(etch.speed("Mask") == 0.0);
    CHECK(etch.model.depends_on_normal);
    CHECK(etch.model.hints.max_speed == Approx(1.05));
    REQUIRE(etch.model.visibility.has_value());
    CHECK(*etch.model.visibility == Vec3::UnitZ());

    const Case tilted =
        step("model = \"directional\"\ndirectional = -2\ndirection = [3, 0, 4]\nvisibility = false\n");
    CHECK_FALSE(tilted.model.visibility.has_value());
    CHECK(tilted.speed("Si") == Approx(-2.0 * 0.8));
    CHECK(tilted.speed("Si", {}, Vec3(0.6, 0.0, 0.8)) == Approx(-2.0));
}

TEST_CASE("single_particle: V is rate times flux, and at flux 1 a blanket wafer moves at its rate") {
    const Case film = step(
        "model = \"single_particle\"\nrate = 1.5\nsticking = { Si = 0.2, Mask = 0.0, default = 0.1 }\n"
        "source_exponent = 3\ndeposit = \"SiO2\"\n");
    CHECK(film.speed("Si", {1.0}) == 1.5);
    CHECK(film.speed("Si", {0.25}) == 0.375);
    CHECK(film.speed("Si", {0.0}) == 0.0);
    REQUIRE(film.model.species.size() == 1);
    const flux::Species& neutral = film.model.species[0];
    CHECK(neutral.source_exponent == 3.0);
    REQUIRE(neutral.sticking.size() == film.recipe.materials.size());
    CHECK(neutral.sticking[static_cast<std::size_t>(film.id("Si"))] == 0.2);
    CHECK(neutral.sticking[static_cast<std::size_t>(film.id("Mask"))] == 0.0);
    CHECK(neutral.sticking[static_cast<std::size_t>(film.id("SiO2"))] == 0.1);
    CHECK_FALSE(film.model.hints.max_speed.has_value());

    const Case etch = step("model = \"single_particle\"\nrate = { Si = -2.0 }\n");
    CHECK(etch.speed("Si", {0.5}) == -1.0);
    CHECK(etch.speed("Mask", {0.5}) == 0.0);
}

TEST_CASE(
    "multi_particle: an ion reflects, may be tilted, and its rate may go with a yield that is 1 on a flat "
    "wafer") {
    const auto etch = step(
        "model = \"multi_particle\"\nspecies = [{ name = \"ion\", kind = \"ion\", rate = -2.0, tilt_deg = "
        "30, rotating = true, azimuth_deg = 90, energy = 200, yield = \"sputter\", threshold = 25 }, { name "
        "= \"n\", rate = -1.0 }]\n");
    REQUIRE(etch.model.species.size() == 2);
    const flux::Species& ion = etch.model.species[0];
    CHECK(ion.source_exponent == 500.0);
    CHECK(ion.energy.mean == 200.0);
    CHECK(ion.energy.sigma == Approx(20.0));
    CHECK(ion.sticking == std::vector<double>{0.0});
    CHECK(ion.reflection.kind == flux::Reemission::coned);
    CHECK(ion.reflection.from == Approx(70.0 / 180.0 * 3.14159265358979));
    CHECK(ion.beam.x() == 0.0);
    CHECK(ion.beam.y() == Approx(0.5));
    CHECK(ion.beam.z() == Approx(-std::sqrt(0.75)));
    CHECK(ion.stop_energy == 25.0);
    CHECK(flux_names(etch.model.species) == std::vector<std::string>{"ion", "ion_yield", "n"});
    // The speed follows the ions' yield, not their arrivals; the neutral is the third flux.
    const std::vector<double> flux{7.0, 0.5, 0.25};
    CHECK(etch.model.speed({0, flux}) == Approx(-2.0 * 0.5 - 0.25));
    CHECK(flux::mean_yield(ion, ion.yields[0]) == Approx(1.0));

    const auto ions = [&](const std::string& keys) {
        return refusal("model = \"multi_particle\"\nspecies = [{ name = \"a\", rate = -1, " + keys + " }]\n");
    };
    CHECK(ion.rotating);
    CHECK(ions("tilt_deg = 10").find("reflective sides") != std::string::npos);
    CHECK(ions("energy = 100").find("is for ions") != std::string::npos);
    CHECK(ions("kind = \"ion\", sticking = 0.5").find("is for neutrals") != std::string::npos);
    CHECK(ions("kind = \"ion\", yield = \"sputter\", threshold = 500").find("above the mean energy") !=
          std::string::npos);
    CHECK(ions("kind = \"ion\", energy_spread = 200").find("larger than the energy") != std::string::npos);
    CHECK(ions("kind = \"ion\", reflect_from_deg = 80, reflect_to_deg = 60").find("swap") !=
          std::string::npos);
}

TEST_CASE("multi_particle: V is the sum of every species' rate times its flux") {
    const Case both = step(
        "model = \"multi_particle\"\ndeposit = \"Polymer\"\nspecies = [\n"
        "{ name = \"film\", rate = 0.5, sticking = 0.3 },\n"
        "{ name = \"ion\", kind = \"collimated\", rate = { Si = -2.0, Polymer = -1.0 } },\n"
        "{ name = \"slow\", rate = -0.1, source_exponent = 5 }]\n");
    CHECK(both.speed("Si", {1.0, 1.0, 1.0}) == Approx(0.5 - 2.0 - 0.1));
    CHECK(both.speed("Polymer", {0.2, 0.5, 3.0}) == Approx(0.5 * 0.2 - 0.5 - 0.3));
    CHECK(both.speed("Mask", {1.0, 1.0, 0.0}) == 0.5);
    REQUIRE(both.model.species.size() == 3);
    CHECK(both.model.species[0].source_exponent == 1.0);
    CHECK(both.model.species[0].sticking[0] == 0.3);
    CHECK(both.model.species[1].name == "ion");
    CHECK(both.model.species[1].source_exponent == 1000.0);
    CHECK(both.model.species[1].sticking[0] == 1.0);
    CHECK(both.model.species[2].source_exponent == 5.0);

    // With one neutral multi_particle is single_particle.
    const Case one =
        step("model = \"multi_particle\"\nspecies = [{ name = \"n\", rate = -1.5, sticking = 0.1 }]\n");
    const Case same = step("model = \"single_particle\"\nrate = -1.5\nsticking = 0.1\n");
    for (const double flux : {0.0, 0.3, 1.0, 1.7}) CHECK(one.speed("Si", {flux}) == same.speed("Si", {flux}));
    CHECK(one.model.species[0].sticking == same.model.species[0].sticking);
}

TEST_CASE("a gas has a mean free path, given or by kinetic theory, in the recipe's length") {
    const auto path = [](const std::string& keys) {
        return step("model = \"single_particle\"\nrate = -1\n" + keys).model.species[0].mean_free_path;
    };
    CHECK(std::isinf(path("")));
    CHECK(std::isinf(path("mean_free_path = \"none\"\n")));
    CHECK(path("mean_free_path = 2.5\n") == 2.5);
    // Air at one atmosphere and 20 degrees Celsius: 0.0657 um (0.066 in tables).
    CHECK(path("pressure = 101325\ntemperature = 293.15\n") ==
          Approx(1e6 * 1.380649e-23 * 293.15 /
                 (std::sqrt(2.0) * 3.14159265358979 * 0.37e-9 * 0.37e-9 * 101325.0))
              .epsilon(1e-12));
    CHECK(path("pressure = 101325\ntemperature = 293.15\n") == Approx(0.0657).epsilon(1e-3));
    CHECK(path("pressure = 10\n") == Approx(path("pressure = 20\ntemperature = 600\n")));
    CHECK(path("pressure = 10\nmolecule_diameter = 0.74\n") == Approx(0.25 * path("pressure = 10\n")));

    // Every model with neutrals has a mean free path.
    CHECK(step("model = \"ald\"\ngrowth_per_cycle = 0.1\npulse = 1\npurge = 1\nprecursor_flux = 1\ndeposit = "
               "\"SiO2\"\nmean_free_path = 3\n")
              .model.species[0]
              .mean_free_path == 3.0);
    const Model teos =
        step(
            "model = \"teos\"\ndeposit = \"SiO2\"\nprecursors = [{ rate = 1 }, { rate = 1, pressure = "
            "10 }]\n")
            .model;
    CHECK(std::isinf(teos.species[0].mean_free_path));
    CHECK(teos.species[1].mean_free_path == Approx(path("pressure = 10\n")));
    const Model formula =
        step(
            "model = \"formula\"\nrate = \"-a\"\nspecies = [{ name = \"b\" }, { name = \"a\", "
            "mean_free_path = 1 }]\n")
            .model;
    CHECK(std::isinf(formula.species[0].mean_free_path));
    CHECK(formula.species[1].mean_free_path == 1.0);
    CHECK(why_monte_carlo(
              step("model = \"single_particle\"\nrate = -1\nsticking = 0.5\npressure = 1\n").model, 0) ==
          "its particles collide in the gas");
}

TEST_CASE("a gas that makes no sense is refused with its place") {
    const auto gas = [](const std::string& keys) {
        return refusal("model = \"single_particle\"\nrate = -1\n" + keys + "\n");
    };
    CHECK(gas("mean_free_path = 0").find("step[0].mean_free_path = 0: must be greater than 0") !=
          std::string::npos);
    CHECK(gas("pressure = -1").find("step[0].pressure = -1: must be") != std::string::npos);
    CHECK(gas("mean_free_path = 1\npressure = 1")
              .find("step[0].pressure = 1: cannot be combined with mean_free_path") != std::string::npos);
    CHECK(gas("temperature = 400").find("step[0].temperature = 400: belongs to pressure") !=
          std::string::npos);
    CHECK(gas("molecule_diameter = 0.4").find("belongs to pressure") != std::string::npos);
    CHECK(
        gas("mean_free_path = 0.009")
            .find(
                "step[0].mean_free_path = 0.009: is below a tenth of grid_spacing: particles would collide too "
                "often to be followed; raise it") != std::string::npos);
    CHECK(gas("pressure = 1e6").find("step[0].pressure = 1000000.0: makes a mean free path of") !=
          std::string::npos);
    const auto several = [](const std::string& keys) {
        return refusal(
            "model = \"multi_particle\"\nspecies = [{ name = \"n\", rate = -1 },\n{ name = \"a\", rate = "
            "-1, " +
            keys + " }]\n");
    };
    CHECK(several("kind = \"ion\", mean_free_path = 1")
              .find("species[1].mean_free_path = 1: is for neutrals") != std::string::npos);
    CHECK(several("mean_free_path = 1e-3").find("species[1].mean_free_path = 0.001: is below a tenth of") !=
          std::string::npos);
    CHECK(several("source_beta = -2").find("species[1].source_beta = -2: must be in [-1,") !=
          std::string::npos);
    CHECK(several("source_beta = 1, source_exponent = 2")
              .find("species[1].source_exponent = 2: comes from source_beta") != std::string::npos);
    CHECK(several("kind = \"ion\", source_beta = 1").find("species[1].source_beta = 1: is for neutrals") !=
          std::string::npos);
    CHECK(several("source_beta = 1").find("accepted") != std::string::npos);
}

TEST_CASE("a model that grows names its film, and one that does not names none") {
    const std::string grow = "missing: a positive rate grows a film";
    CHECK(refusal("model = \"isotropic\"\nrate = 1\n").find("step[0].deposit: " + grow) != std::string::npos);
    CHECK(refusal("model = \"isotropic\"\nrate = { Si = -1, SiO2 = 0.1 }\n").find(grow) != std::string::npos);
    CHECK(refusal("model = \"single_particle\"\nrate = 1\n").find(grow) != std::string::npos);
    CHECK(refusal("model = \"directional\"\ndirectional = -1\nisotropic = 0.5\n").find(grow) !=
          std::string::npos);
    CHECK(refusal("model = \"directional\"\ndirectional = 1\nisotropic = -0.5\n").find(grow) !=
          std::string::npos);
    CHECK(refusal("model = \"isotropic\"\nrate = -1\ndeposit = \"SiO2\"\n").find("no rate is positive") !=
          std::string::npos);
    CHECK(refusal("model = \"isotropic\"\nrate = 0\n") == "accepted");
}

TEST_CASE("keys that do not fit together are refused with their place") {
    CHECK(refusal("model = \"directional\"\ndirectional = -1\ndirection = [1, 0, 0]\n")
              .starts_with("step.toml:10: step[0].direction = [1, 0, 0]: "));
    CHECK(refusal("model = \"multi_particle\"\nspecies = [{ name = \"a\", rate = 0 },\n{ name = \"a\", rate "
                  "= 0 }]\n")
              .starts_with("step.toml:10: step[0].species[1].name = \"a\": is taken"));
}

TEST_CASE("every key of a model has a name of its own and fills a member of its own") {
    for (const ModelEntry& model : models()) {
        std::any parameters = model.defaults;
        std::set<std::string> names;
        std::set<const void*> members;
        for (const Key& key : model.keys(parameters)) {
            INFO(model.name << ": " << key.name);
            CHECK(names.insert(key.name).second);
            std::visit(
                [&](const auto& target) {
                    if constexpr (std::is_pointer_v<std::decay_t<decltype(target)>>)
                        CHECK(members.insert(target).second);
                },
                key.target);
        }
    }
}

TEST_CASE("the member of a key is found by the key's name and the member's type") {
    double number = 0.5;
    const std::vector<Key> keys{{"sticking", &number, "", ""}};
    CHECK(target_of<double>(keys, "sticking") == &number);
    CHECK(target_of<double>(keys, "sticknig") == nullptr);
    CHECK(target_of<ByMaterial>(keys, "sticking") == nullptr);
}

TEST_CASE("a tilted beam between reflective sides is refused at the key that tilts it") {
    const std::string wafer =
        "[domain]\nextent = [1.0, 1.0]\ngrid_spacing = 0.1\nboundary = [\"reflective\", \"periodic\"]\n"
        "[[layer]]\nmaterial = \"Si\"\n[[step]]\nduration = 1.0\nmodel = ";
    const std::string several = wafer +
                                "\"multi_particle\"\nspecies = [{ name = \"n\", rate = -1.0 },\n"
                                "  { name = \"i\", kind = \"ion\", rate = -1.0, tilt_deg = 10.0";
    CHECK_THROWS_WITH(parse_recipe(several + " }]\n", "beam.toml"),
                      Catch::Contains("beam.toml:11: step[0].species[1].tilt_deg = 10.0") &&
                          Catch::Contains("would mirror it"));
    CHECK_NOTHROW(parse_recipe(several + ", azimuth_deg = 90.0 }]\n", "beam.toml"));
    CHECK_THROWS_WITH(parse_recipe(wafer + "\"ion_beam\"\nrate = 1.0\ntilt_deg = 10.0\n", "beam.toml"),
                      Catch::Contains("beam.toml:11: step[0].tilt_deg = 10.0"));
}
