#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "app/process/simulation.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/integration/run_program.hpp"

// Profiles in x and z: extent = [10.0].
using namespace sidewall;
using namespace sidewall::app;

namespace {

const std::string kFlatWafer = R"([domain]
extent = [4.0]
grid_spacing = 0.25
[[layer]]
material = "Si"
shape = "trench"
width = 2.0
depth = 2.0
)";
const std::string kFlatStep =
    "[[step]]\nmodel = \"single_particle\"\nduration = 0.5\nrate = 1.0\nsticking = 0.2\ndeposit = \"SiO2\"\n";
const std::string kFew = "[flux]\nrays = 2000\n";

std::string refusal(const std::string& text) {
    try {
        parse_recipe(text, "flat.toml");
    } catch (const RecipeError& error) {
        return error.what();
    }
    return "accepted";
}

Json summary(const std::string& name, const std::vector<std::string>& overrides) {
    const test::Folder folder;
    const Recipe recipe = load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/" + name, overrides);
    return run_recipe(recipe, {.output = folder.path, .quiet = true}).summary;
}

}  // namespace

TEST_CASE("an extent of one number is a strip of one cell, periodic along y", "[foreign]") {
    const Recipe recipe = parse_recipe(kFlatWafer + kFlatStep, "flat.toml");
    const levelset::Domain domain = domain_of(recipe);
    CHECK(domain.cells == std::array<int, 2>{16, 1});
    CHECK(domain.side[1] == levelset::Side::periodic);
    CHECK(domain.side[0] == levelset::Side::reflective);
    CHECK(domain.max[1] - domain.min[1] == domain.spacing);
    CHECK(recipe.output.profiles == std::vector<std::string>{"y=0"});
    const std::string written = effective_recipe(recipe);
    INFO(written);
    CHECK(written.find("extent = [4.0]") != std::string::npos);
    CHECK(effective_recipe(parse_recipe(written, "flat.toml")) == written);
}

TEST_CASE("what ends along y is refused in a profile, and the message names what does not", "[foreign]") {
    const std::string domain = "[domain]\nextent = [4.0]\ngrid_spacing = 0.1\n";
    const std::string substrate = "[[layer]]\nmaterial = \"Si\"\n";
    const auto check = [&](const std::string& keys, const char* instead) {
        const std::string message = refusal(domain + substrate + "[[layer]]\n" + keys + kFlatStep);
        CAPTURE(keys, message);
        CHECK(message.find("domain.extent") != std::string::npos);
        CHECK(message.find(instead) != std::string::npos);
        CHECK(message.find("flat.toml:") == 0);
    };
    check("material = \"W\"\nshape = \"hole\"\nthickness = 1.0\nradius = 1.0\n", "use a trench");
    check("material = \"W\"\nshape = \"box\"\nsize = [1.0, 1.0]\nheight = 1.0\n", "use a fin");
    check("subtract = true\nshape = \"sphere\"\nradius = 1.0\n", "use a cylinder along y");
    check("subtract = true\nshape = \"cylinder\"\nradius = 1.0\naxis = \"x\"\n", "use \"y\"");
    check("subtract = true\nshape = \"gap\"\nlength = 2.0\nheight = 1.0\nwidth = 1.0\n", "drop the width");
    check(
        "material = \"W\"\nshape = \"mask\"\nthickness = 1.0\npolygons = [{ points = [0, 0, 1, 0, 1, 1] }]\n",
        "use a trench");
    const std::string pattern = refusal(
        domain + substrate + "[[step]]\nmodel = \"cut\"\ndepth = 1.0\nshape = \"hole\"\nradius = 1.0\n");
    CHECK(pattern.find("use a trench") != std::string::npos);
    const std::string across = refusal(kFlatWafer + kFlatStep + "[output]\nprofiles = [\"x=0\"]\n");
    CHECK(across.find("use \"y=0\"") != std::string::npos);
    const std::string rough = refusal(kFlatWafer + kFlatStep + "[metrology]\nmeasures = [\"ler_at_0.5\"]\n");
    CHECK(rough.find("domain.extent") != std::string::npos);
    CHECK(refusal(domain + substrate + "[[layer]]\nsubtract = true\nshape = \"cylinder\"\nradius = 1.0\n" +
                  kFlatStep) == "accepted");
}

TEST_CASE("a strip of one cell grows the film of one ten cells wide, within the noise of the fluxes") {
    const std::vector<std::string> common{"step[0].duration=0.5"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.end(), common.begin(), common.end());
        return summary("trench_profile.toml", more)["metrology"];
    };
    const Json narrow = with({});  // radiosity in a profile has no noise
    std::vector<Json> wide;
    for (const char* seed : {"1", "2", "3", "4", "5"})
        wide.push_back(with({"domain.extent=[10.0, 2.5]", "domain.boundary=[\"reflective\", \"periodic\"]",
                             "flux.rays=50000", std::string("flux.seed=") + seed}));
    for (const char* name : {"film_side", "film_bottom", "depth", "mean_rate"}) {
        double mean = 0.0, squares = 0.0;
        for (const Json& one : wide) mean += one[name].get<double>() / 5.0;
        for (const Json& one : wide) squares += std::pow(one[name].get<double>() - mean, 2);
        // Student's t of 4 degrees of freedom stays below 8.6 in all but 1 of 1000; a thousandth of a cell is
        // what re-distancing keeps.
        const double sigma = std::sqrt(squares / 4.0 / 5.0);
        CAPTURE(name, mean, sigma);
        CHECK(std::abs(mean - narrow[name].get<double>()) < 8.6 * sigma + 0.001 * 0.25);
    }
    CHECK(narrow["added_volume_SiO2"].get<double>() ==
          Approx(wide[0]["added_volume_SiO2"].get<double>() / 2.5).epsilon(0.01));
}

TEST_CASE("radiosity and tracing agree on a strip") {
    const auto with = [&](const char* method, const char* seed) {
        return summary("trench_profile.toml",
                       {"step[0].duration=0.5", "flux.rays=200000", std::string("flux.method=") + method,
                        std::string("flux.seed=") + seed})["metrology"]["mean_rate"]
            .get<double>();
    };
    // The volume of the film has a noise of 0.05 %; on so coarse a grid linear elements add 0.3 % at corners.
    CHECK(with("radiosity", "1") == Approx(with("monte-carlo", "2")).epsilon(0.005));
}

TEST_CASE("a thin strip that is the same along y is the profile, with the files and volumes of the strip") {
    const test::Folder folder;
    const std::string text = kFlatWafer + kFlatStep + kFew + "[output]\nprofiles = [\"y=0\"]\n";
    const auto run = [&](const std::string& name, const std::vector<std::string>& settings) {
        return run_recipe(parse_recipe(text, "strip.toml", settings),
                          {.output = folder.path / name, .quiet = true})
            .summary;
    };
    const std::string two = "domain.extent=[4, 1]";
    const Json flat = run("flat", {}), strip = run("strip", {two}),
               space = run("space", {two, "domain.strip=\"space\""});
    CHECK(strip["volume_unit"] == "um^3");
    CHECK(flat["volume_unit"] == "um^2");
    CHECK(strip["steps"][0]["time_steps"] == flat["steps"][0]["time_steps"]);
    const auto added = [](const Json& json) { return json["metrology"]["added_volume_SiO2"].get<double>(); };
    CHECK(added(strip) == Approx(added(flat)).epsilon(1e-12));  // the strip is 1 um wide
    CHECK(added(strip) == Approx(added(space)).epsilon(0.05));
    const auto profile = [&](const std::string& name) {
        return test::read_bytes(folder.path / name / "profile_0001.csv");
    };
    CHECK(profile("strip") == profile("flat"));
    const auto box = [&](const std::string& file) {
        return bounding_box(surface::read_mesh(folder.path / file));
    };
    for (const char* file :
         {"strip/surface_0001.vtp", "strip/interface_0001_0.vtp", "space/surface_0001.vtp"}) {
        CAPTURE(file);
        CHECK(box(file).min.y() == Approx(-0.5));
        CHECK(box(file).max.y() == Approx(0.5));
    }
    // The result's copy of the recipe keeps the strip, and another run can start from it.
    CHECK(load_recipe(folder.path / "strip/recipe.toml").domain ==
          parse_recipe(text, "strip.toml", {two}).domain);
    const std::string start = "[domain]\nextent = [4.0, 1.0]\ngrid_spacing = 0.25\n[start]\nfrom = \"";
    for (const char* from : {"strip", "space"}) {
        const Recipe next =
            parse_recipe(start + (folder.path / from).string() + "\"\n" + kFlatStep, "next.toml");
        CHECK((next.domain.strip == Strip::profile) == (from == std::string("strip")));
        CHECK_NOTHROW(
            run_recipe(next, {.output = folder.path / (std::string("from_") + from), .quiet = true}));
    }
    // A recipe that needs more than a profile runs in space.
    const auto is_profile = [&](const std::vector<std::string>& settings, const std::string& more = "") {
        return parse_recipe(kFlatWafer + more + kFlatStep, "flat.toml", settings).domain.strip ==
               Strip::profile;
    };
    CHECK(is_profile({"domain.extent=[4, 2]"}));
    CHECK_FALSE(is_profile({"domain.extent=[4, 2.5]"}));
    CHECK_FALSE(is_profile({two, "metrology.cut=\"x=0\""}));
    CHECK_FALSE(is_profile({two, "output.profiles=[\"x=0\"]"}));
    CHECK_FALSE(is_profile({two}, "[[layer]]\nsubtract = true\nshape = \"sphere\"\nradius = 1.0\n"));
    CHECK(refusal(kFlatWafer + "[[layer]]\nsubtract = true\nshape = \"sphere\"\nradius = 1.0\n" + kFlatStep)
              .find("no strip") != std::string::npos);
}

TEST_CASE("commands know profiles: areas, a section for a picture, a cut for a file, resuming, sweeping") {
    const test::Folder folder;
    std::ofstream(folder.path / "flat.toml") << kFlatWafer + kFlatStep + kFew + "[output]\nevery = 0.25\n";
    REQUIRE(test::run_program(folder.path, "run flat.toml -o run --quiet").exit_code == 0);
    const Json json = Json::parse(test::read_bytes(folder.path / "run/summary.json"));
    CHECK(json["volume_unit"] == "um^2");
    CHECK(json["metrology_units"]["added_volume_SiO2"] == "um^2");
    // Two ledges of 1, a floor of 2, and two walls of 2, covered by at most the blanket rate.
    CHECK(json["metrology"]["added_volume_SiO2"].get<double>() < 0.5 * 8.0);
    CHECK(json["metrology"]["added_volume_SiO2"].get<double>() > 0.5 * 2.0);
    CHECK(std::filesystem::exists(folder.path / "run/profile_0002.csv"));
    REQUIRE(test::run_program(folder.path, "render run -o a.png --size 96x96").exit_code == 0);
    REQUIRE(test::run_program(folder.path, "render run -o b.png --size 96x96 --view 0,0").exit_code == 0);
    CHECK(test::read_bytes(folder.path / "a.png") == test::read_bytes(folder.path / "b.png"));
    CHECK(test::run_program(folder.path, "inspect run").exit_code == 0);
    const test::Outcome inspected =
        test::run_program(folder.path, "inspect run --measure thickness_SiO2_at_1.5 --measure volume_SiO2");
    INFO(inspected.output);
    CHECK(inspected.exit_code == 0);
    CHECK(inspected.output.find("thickness_SiO2_at_1.5") != std::string::npos);
    CHECK(inspected.output.find("um^2") != std::string::npos);
    CHECK(test::run_program(folder.path, "inspect run --measure volum_SiO2")
              .output.find("did you mean volume_SiO2?") != std::string::npos);
    CHECK(test::run_program(folder.path, "check flat.toml").exit_code == 0);
    CHECK(test::run_program(folder.path, "run flat.toml -o run --quiet --resume --set step[0].duration=0.75")
              .exit_code == 0);
    REQUIRE(test::run_program(folder.path, "run flat.toml -o long --quiet --set step[0].duration=0.75")
                .exit_code == 0);
    CHECK(test::read_bytes(folder.path / "run/surface_0003.vtp") ==
          test::read_bytes(folder.path / "long/surface_0003.vtp"));
    CHECK(
        test::run_program(folder.path,
                          "sweep flat.toml --vary step[0].sticking=0.1,1.0 --measure wall_SiO2_at_1 -o sweep")
            .exit_code == 0);
    CHECK(test::read_bytes(folder.path / "sweep/sweep.csv").find("wall_SiO2_at_1") != std::string::npos);
}

TEST_CASE("a substrate that ends at z = 0 is among the volumes of a step that leaves it alone") {
    const test::Folder folder;
    const std::string film = "[[step]]\nmodel = \"conformal\"\nmaterial = \"W\"\nthickness = 0.3\n";
    const Recipe recipe = parse_recipe(
        "[domain]\nextent = [4.0]\ngrid_spacing = 0.25\n[[layer]]\nmaterial = \"Si\"\n" + film, "flat.toml");
    const Json json = run_recipe(recipe, {.output = folder.path, .quiet = true}).summary;
    REQUIRE(json["metrology"].contains("removed_volume_Si"));
    CHECK(json["metrology"]["added_volume_Si"] == 0.0);
    CHECK(json["volumes"].contains("Si"));
    CHECK_FALSE(json["volumes"].contains("SiO2"));
}
