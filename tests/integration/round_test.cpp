#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "app/devices/revolved.hpp"
#include "app/process/simulation.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/results/metrology.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/integration/run_program.hpp"

// Profiles of round wafers in r and z: symmetry = "axial".
using namespace sidewall;
using namespace sidewall::app;

namespace {

constexpr double kPi = std::numbers::pi;

const std::string kRoundDomain = "[domain]\nextent = [2.0]\nsymmetry = \"axial\"\ngrid_spacing = 0.1\n";
const std::string kRoundHole =
    kRoundDomain + "[[layer]]\nmaterial = \"Si\"\nshape = \"hole\"\nradius = 1.0\ndepth = 2.0\n";
const std::string kSticking =
    "[[step]]\nmodel = \"single_particle\"\nduration = 0.3\nrate = 1.0\nsticking = 0.1\ndeposit = \"SiO2\"\n";
const std::string kBeam =
    "[[step]]\nmodel = \"ion_beam\"\nduration = 1.0\nrate = { Si = 0.005 }\ntilt_deg = 20.0\n";
const std::string kConformal =
    "[[step]]\nmodel = \"isotropic\"\nduration = 0.4\nrate = 1.0\ndeposit = \"SiO2\"\n";

std::string refusal(const std::string& text) {
    try {
        parse_recipe(text, "round.toml");
    } catch (const RecipeError& error) {
        return error.what();
    }
    return "accepted";
}

Json summary(const std::string& text, const std::vector<std::string>& overrides = {}) {
    const test::Folder folder;
    return run_recipe(parse_recipe(text, "round.toml", overrides), {.output = folder.path, .quiet = true})
        .summary;
}

}  // namespace

TEST_CASE("a round wafer is a profile from the axis to a mirror", "[foreign]") {
    const Recipe recipe = parse_recipe(kRoundHole + kSticking, "round.toml");
    const levelset::Domain domain = domain_of(recipe);
    CHECK(domain.axial);
    CHECK(domain.min[0] == 0.0);
    CHECK(domain.max[0] == 2.0);
    CHECK(domain.cells == std::array<int, 2>{20, 1});
    const std::string written = effective_recipe(recipe);
    INFO(written);
    CHECK(written.find("symmetry = \"axial\"") != std::string::npos);
    CHECK(effective_recipe(parse_recipe(written, "round.toml")) == written);
}

TEST_CASE("what is not round is refused, and the message says what would work", "[foreign]") {
    const std::string substrate = kRoundDomain + "[[layer]]\nmaterial = \"Si\"\n";
    const auto check = [&](const std::string& text, const char* instead) {
        const std::string message = refusal(text);
        CAPTURE(text, message);
        CHECK(message.find(instead) != std::string::npos);
        CHECK(message.find("round.toml:") == 0);
    };
    const auto layer = [&](const std::string& keys, const char* instead) {
        check(substrate + "[[layer]]\n" + keys + kSticking, instead);
    };
    layer("material = \"W\"\nshape = \"box\"\nsize = [1.0, 1.0]\nheight = 1.0\n", "use a fin");
    layer(
        "material = \"W\"\nshape = \"mask\"\nthickness = 1.0\npolygons = [{ points = [0, 0, 1, 0, 1, 1] }]\n",
        "use a hole");
    layer("material = \"W\"\nshape = \"hole\"\nthickness = 1.0\nradius = 0.5\nposition = [0.5, 0.0]\n",
          "[0, 0]");
    layer("subtract = true\nshape = \"cylinder\"\nradius = 0.5\naxis = \"x\"\n", "use \"z\"");
    const auto domain = [&](const std::string& keys, const char* instead) {
        check("[domain]\nsymmetry = \"axial\"\ngrid_spacing = 0.1\n" + keys +
                  "[[layer]]\nmaterial = \"Si\"\n" + kSticking,
              instead);
    };
    domain("extent = [2.0, 2.0]\n", "one number");
    domain("extent = [2.0]\nboundary = \"periodic\"\n", "give extent two");
    domain("extent = [2.0]\nboundary = [\"reflective\", \"periodic\"]\n", "give extent two");
    check(substrate +
              "[[step]]\nmodel = \"wet\"\nmaterial = \"Si\"\nduration = 1.0\n"
              "r100 = 0.8\nr110 = 1.4\nr111 = 0.01\nr311 = 1.4\n",
          "extent two numbers");
    check(substrate + kBeam, "rotating = true");
    CHECK(refusal(substrate + kBeam + "rotating = true\n") == "accepted");
    CHECK(refusal(substrate +
                  "[[layer]]\nmaterial = \"W\"\nshape = \"trench\"\nthickness = 1.0\nwidth = 0.5\n"
                  "position = [1.0, 0.0]\n" +
                  kSticking) == "accepted");
}

TEST_CASE("volumes of round wafers are those of the revolution") {
    // A mask of thickness 1 with a hole of radius 0.7, on a wafer of radius 2.
    const auto volumes = [](const std::string& layers) {
        const Recipe recipe =
            parse_recipe(kRoundDomain + "[[layer]]\nmaterial = \"Si\"\n" + layers + kConformal, "round.toml",
                         {"domain.grid_spacing=0.025"});
        return layer_volumes(initial_state(recipe).stack);
    };
    const double mask =
        volumes("[[layer]]\nmaterial = \"W\"\nshape = \"hole\"\nthickness = 1.0\nradius = 0.7\n")[1];
    CHECK(mask == Approx(kPi * (4.0 - 0.49)).epsilon(1e-4));
    // Crossings keep a thousandth of a cell away from nodes: on nodes the top is 3e-5 of this height inside,
    // walls 1e-4 of this width.
    for (const double width : {0.5, 0.513}) {
        const double ring = volumes(fmt::format(
            "[[layer]]\nmaterial = \"W\"\nshape = \"fin\"\nwidth = {}\nheight = 0.8\nposition = [1.0, 0.0]\n",
            width))[1];
        CHECK(ring == Approx(2.0 * kPi * width * 0.8).epsilon(width == 0.5 ? 1.1e-4 : 1e-5));
    }
    // Ten cells a radius.
    const auto of_body = [&](const std::string& keys) {
        return layer_volumes(
            initial_state(parse_recipe(kRoundDomain +
                                           "[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"W\"\n" +
                                           keys + kConformal,
                                       "round.toml"))
                .stack)[1];
    };
    for (const double z : {3.0, 3.013, 3.04}) {
        CAPTURE(z);
        CHECK(of_body(fmt::format("shape = \"sphere\"\nradius = 1.0\nz = {}\n", z)) ==
              Approx(4.0 / 3.0 * kPi).epsilon(1e-4));
        CHECK(of_body(fmt::format(
                  "shape = \"cylinder\"\naxis = \"y\"\nradius = 0.9\nposition = [1.0, 0.0]\nz = {}\n", z)) ==
              Approx(2.0 * kPi * kPi * 0.81).epsilon(1e-4));
    }
}

TEST_CASE("a sphere, a torus and a ring groove about the axis grow to second order in the grid spacing") {
    const std::string
        substrate = kRoundDomain + "[[layer]]\nmaterial = \"Si\"\n",
        low = substrate + "top = -3.0\n",
        sphere = "[[layer]]\nmaterial = \"W\"\nshape = \"sphere\"\nradius = 0.8\nz = 0.0\n",
        circle = "shape = \"cylinder\"\naxis = \"y\"\nradius = 0.4\nposition = [1.0, 0.0]\nz = 0.0\n",
        step = "[[step]]\nmodel = \"isotropic\"\nduration = 0.2\n",
        film = step + "rate = { W = 1.0, SiO2 = 1.0, default = 0.0 }\ndeposit = \"SiO2\"\n";
    // The flat top sinks, too: only a cap of the groove is left below it.
    const double cap = 0.36 * std::acos(0.2 / 0.6) - 0.2 * std::sqrt(0.36 - 0.04);
    for (const double spacing : {0.1, 0.05, 0.025}) {
        const std::vector<std::string> grid{fmt::format("domain.grid_spacing={}", spacing)};
        const auto volume = [&](const std::string& recipe, const char* name) {
            return summary(recipe, grid)["metrology"][name].get<double>();
        };
        const auto allowed = [&](double radius) { return 0.1 * std::pow(spacing / radius, 2); };
        CAPTURE(spacing);
        CHECK(volume(low + sphere + film, "added_volume_SiO2") ==
              Approx(4.0 / 3.0 * kPi * (1.0 - 0.512)).epsilon(allowed(0.8)));
        CHECK(volume(low + "[[layer]]\nmaterial = \"W\"\n" + circle + film, "added_volume_SiO2") ==
              Approx(2.0 * kPi * kPi * (0.36 - 0.16)).epsilon(allowed(0.4)));
        CHECK(volume(substrate + "[[layer]]\nsubtract = true\n" + circle + step + "rate = { Si = -1.0 }\n",
                     "removed_volume_Si") ==
              Approx(4.0 * kPi * 0.2 + 2.0 * kPi * cap - kPi * kPi * 0.16).epsilon(allowed(0.4)));
    }
}

TEST_CASE("a sphere and a torus about the axis shrink to second order in the grid spacing") {
    const std::string substrate = kRoundDomain + "[[layer]]\nmaterial = \"Si\"\ntop = -3.0\n",
                      etch = "[[step]]\nmodel = \"isotropic\"\nrate = { W = -1.0, default = 0.0 }\n",
                      sphere = "[[layer]]\nmaterial = \"W\"\nshape = \"sphere\"\nradius = 1.0\nz = 0.0\n",
                      torus =
                          "[[layer]]\nmaterial = \"W\"\nshape = \"cylinder\"\naxis = \"y\"\nradius = 0.4\n"
                          "position = [1.0, 0.0]\nz = 0.0\n";
    for (const double spacing : {0.1, 0.05, 0.025}) {
        const std::vector<std::string> grid{fmt::format("domain.grid_spacing={}", spacing)};
        const auto removed = [&](const std::string& body, double way) {
            return summary(fmt::format("{}{}{}duration = {}\n", substrate, body, etch, way),
                           grid)["metrology"]["removed_volume_W"]
                .get<double>();
        };
        const auto allowed = [&](double radius) { return 0.06 * std::pow(spacing / radius, 2); };
        CAPTURE(spacing);
        CHECK(removed(sphere, 0.4) == Approx(4.0 / 3.0 * kPi * (1.0 - 0.216)).epsilon(allowed(0.6)));
        if (spacing > 0.05) continue;  // the torus ends with two cells a radius, too few for its volume
        CHECK(removed(torus, 0.2) == Approx(2.0 * kPi * kPi * (0.16 - 0.04)).epsilon(allowed(0.2)));
    }
}

TEST_CASE("a conformal film in a round hole is the offset of the hole") {
    const Json end = summary(kRoundHole + kConformal)["metrology"];
    // Walls and floor move by 0.4, the rim becomes a quarter of a torus about r = 1 (Pappus).
    const double disk = 0.25 * kPi * 0.4 * 0.4, centroid = 4.0 * 0.4 / (3.0 * kPi);
    const double exact = kPi * (4.0 - 1.0) * 0.4 + disk * 2.0 * kPi * (1.0 - centroid) +
                         kPi * (1.0 - 0.36) * (2.0) + kPi * 0.36 * 0.4;
    CHECK(end["added_volume_SiO2"].get<double>() == Approx(exact).epsilon(5e-3));
}

TEST_CASE("a round profile has the film of the hole that it stands for") {
    const std::vector<std::string> square{"domain.extent=[4.0, 4.0]", "domain.symmetry=none",
                                          "flux.rays=1600000"};
    const Json solid = summary(kRoundHole + kSticking + "[metrology]\nmeasures = [\"film\", \"depth\"]\n",
                               square)["metrology"],
               profile = summary(kRoundHole + kSticking + "[metrology]\nmeasures = [\"film\", \"depth\"]\n",
                                 {"flux.rays=100000"})["metrology"];
    // Edges of neighbouring cells do not matter to a hole in a flat top. Tolerance: a hundredth of the film
    // and a twentieth of a cell.
    for (const char* name : {"film_top", "film_side", "film_bottom", "depth"}) {
        CAPTURE(name);
        CHECK(profile[name].get<double>() ==
              Approx(solid[name].get<double>()).margin(0.01 * solid["film_top"].get<double>() + 0.005));
    }
}

TEST_CASE("radiosity and tracing agree on a round wafer") {
    const auto with = [&](const char* method) {
        return summary(kRoundHole + kSticking + "[metrology]\nmeasures = [\"film\"]\n",
                       {"flux.rays=200000", std::string("flux.method=") + method})["metrology"];
    };
    const Json solved = with("radiosity"), traced = with("monte-carlo");
    for (const char* name : {"film_top", "film_side", "mean_rate"}) {
        CAPTURE(name);
        CHECK(solved[name].get<double>() == Approx(traced[name].get<double>()).epsilon(0.01));
    }
    // The floor's film is measured at the axis, where rings are smallest: in each of seven time steps these
    // paths leave an error of 5 % there.
    CHECK(solved["film_bottom"].get<double>() == Approx(traced["film_bottom"].get<double>()).epsilon(0.04));
}

TEST_CASE("a round run has the same bits on one thread and several") {
    const test::Folder folder;
    test::write_bytes(folder.path / "round.toml", kRoundHole + kSticking + "[flux]\nrays = 20000\n");
    for (const std::string method : {"monte-carlo", "radiosity"}) {
        std::vector<std::string> surfaces;
        for (const int threads : {1, 2}) {
            const std::string out = fmt::format("{}{}", method, threads);
            REQUIRE(test::run_program(folder.path,
                                      fmt::format("run round.toml -o {} --threads {} --set flux.method={}",
                                                  out, threads, method))
                        .exit_code == 0);
            surfaces.push_back(test::read_bytes(folder.path / out / "surface_0001.vtp"));
        }
        CHECK(!surfaces[0].empty());
        CHECK(surfaces[0] == surfaces[1]);
    }
}

TEST_CASE("a round run that was killed goes on to the same bits") {
    const test::Folder folder;
    test::write_bytes(folder.path / "round.toml",
                      kRoundHole + kSticking + "[flux]\nrays = 20000\n[output]\nevery = 0.1\n");
    REQUIRE(test::run_program(folder.path, "run round.toml -o whole --quiet").exit_code == 0);
    bool in_the_middle = false;
    for (int operation = 20; operation < 200 && !in_the_middle; operation += 20) {
        const std::string arguments = "run round.toml -o killed --quiet";
        CHECK(test::run_with_fault(folder.path, fmt::format("kill {}", operation), arguments + " --overwrite")
                  .exit_code != 0);
        in_the_middle = std::filesystem::exists(folder.path / "killed/checkpoint.vdb") &&
                        test::last_time(folder.path / "killed") >= 0.1;
        if (in_the_middle) CHECK(test::run_program(folder.path, arguments + " --resume").exit_code == 0);
    }
    REQUIRE(in_the_middle);
    CHECK(test::read_bytes(folder.path / "killed/surface_0003.vtp") ==
          test::read_bytes(folder.path / "whole/surface_0003.vtp"));
}

TEST_CASE("the area of a round wafer is that of its revolution") {
    const test::Folder folder;
    test::write_bytes(folder.path / "round.toml", kRoundHole + kSticking);
    REQUIRE(test::run_program(folder.path, "run round.toml -o out --quiet").exit_code == 0);
    REQUIRE(test::run_program(folder.path, "inspect out/surface_0000.vtp --json area.json").exit_code == 0);
    const Json json = Json::parse(test::read_bytes(folder.path / "area.json"));
    // Top and floor are a disc of radius 2, the wall is 2 high at radius 1.
    CHECK(json["surface"]["area"].get<double>() == Approx(8.0 * kPi).epsilon(1e-4));
}

TEST_CASE("rings that reach over the axis are refused") {
    for (const std::string position : {"0.2", "-0.3", "-1.0"})
        CHECK(refusal(
                  kRoundDomain +
                  "[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 1.0\ndepth = 1.0\nposition = [" +
                  position + ", 0.0]\n" + kSticking)
                  .find("the ring reaches over the axis") != std::string::npos);
    const std::string gap = kRoundDomain +
                            "[[layer]]\nmaterial = \"Si\"\n[[layer]]\nshape = \"gap\"\nsubtract = true\n" +
                            "z = -1.0\nlength = 1.0\nheight = 0.3\n";
    CHECK(refusal(gap + "position = [0.2, 0.0]\n" + kSticking).find("the ring reaches over the axis") !=
          std::string::npos);
    CHECK(refusal(gap + "position = [0.5, 0.0]\n" + kSticking) == "accepted");
}

TEST_CASE("a round wafer's thickness is measured from its axis to its edge") {
    const auto measured_at = [](const std::string& x) {
        return refusal(kRoundHole + kSticking + "[metrology]\nmeasures = [\"thickness_SiO2_at_" + x +
                       "\"]\n");
    };
    for (const std::string x : {"0", "0.5", "1.9"}) CHECK(measured_at(x) == "accepted");
    for (const std::string x : {"-0.2", "2.1"})
        CHECK(measured_at(x).find("lies outside the domain, from 0 to 2") != std::string::npos);
}

TEST_CASE("both ends of a ring have its flux in files, and no command takes its strip for a surface") {
    const test::Folder folder;
    test::write_bytes(
        folder.path / "round.toml",
        kRoundHole + kSticking +
            "[flux]\nmethod = \"monte-carlo\"\nrays = 20000\n[simplify]\nmethod = \"region-bounded\"\n");
    REQUIRE(test::run_program(folder.path, "run round.toml -o out --quiet").exit_code == 0);
    const TriangleMesh traced = surface::read_mesh(folder.path / "out/traced_0001.vtp");
    const std::vector<double>& flux = traced.vertex_attribute("flux_neutral")->values;
    for (std::size_t v = 0; v + 1 < flux.size(); v += 2) {
        CAPTURE(v, flux[v]);
        CHECK(flux[v] > 0.0);
        CHECK(flux[v + 1] == flux[v]);
    }
    const auto again = test::run_program(folder.path, "flux out/surface_0001.vtp -o flux.csv");
    CHECK(again.exit_code == 2);
    CHECK(again.output.find("round wafer") != std::string::npos);
    CHECK(test::run_program(folder.path, "export out -o cut.csv --cut x=0.5").exit_code == 2);
    CHECK(test::run_program(folder.path, "export out -o cut.csv --cut y=0").exit_code == 0);
    // The surface all around is one.
    REQUIRE(test::run_program(folder.path, "export out -o around.vtp").exit_code == 0);
    CHECK(test::run_program(folder.path, "flux around.vtp --boundary open -o flux.csv").exit_code == 0);
}

TEST_CASE("fluxes averaged over a round floor are those of the wafer in space", "[slow]") {
    // The mean over the floor of a hole weights rings by their area.
    const auto mean_of_floor = [](const std::string& domain, const std::string& averaging) {
        const test::Folder folder;
        test::write_bytes(
            folder.path / "hole.toml",
            domain + "[[layer]]\nmaterial = \"Si\"\nshape = \"hole\"\nradius = 0.5\ndepth = 1.0\n" +
                "[[step]]\nmodel = \"single_particle\"\nduration = 0.001\nrate = 1.0\nsticking = 1.0\n" +
                "deposit = \"SiO2\"\n[simplify]\nmethod = \"none\"\n[flux]\nmethod = \"monte-carlo\"\n" +
                "rays = 1000000\n" + averaging);
        REQUIRE(test::run_program(folder.path, "run hole.toml -o out --quiet").exit_code == 0);
        const TriangleMesh mesh = surface::read_mesh(folder.path / "out/surface_0001.vtp");
        const std::vector<double>& flux = mesh.triangle_attribute("flux_neutral")->values;
        double sum = 0.0, area = 0.0;
        const bool round = domain.find("axial") != std::string::npos;
        for (std::size_t t = 0; t < flux.size(); ++t) {
            const Vec3 at = triangle_centroid(mesh, t);
            const double r = round ? at.x() : std::hypot(at.x(), at.y());
            if (at.z() > -0.9 || r > 0.45) continue;
            const double weight = triangle_area(mesh, t) * (round ? r : 1.0);
            sum += weight * flux[t], area += weight;
        }
        return sum / area;
    };
    const std::string space = "[domain]\nextent = [2.0, 2.0]\ngrid_spacing = 0.05\n",
                      round = "[domain]\nextent = [1.0]\nsymmetry = \"axial\"\ngrid_spacing = 0.05\n";
    for (const std::string averaging : {"", "averaging = 0.2\n"}) {
        CAPTURE(averaging);
        CHECK(mean_of_floor(round, averaging) == Approx(mean_of_floor(space, averaging)).epsilon(0.015));
    }
}

TEST_CASE("the foot of a tapered mask is where it was after a time step of averaged fluxes") {
    // The floor lies on nodes, the foot three quarters of a cell beyond one.
    const test::Folder folder;
    test::write_bytes(
        folder.path / "hole.toml",
        "[domain]\nextent = [0.5]\nsymmetry = \"axial\"\ngrid_spacing = 0.02\n"
        "[[layer]]\nmaterial = \"Si\"\n"
        "[[layer]]\nmaterial = \"Mask\"\nshape = \"hole\"\nthickness = 1.2\nradius = 0.2\ntaper_deg = 1.193\n"
        "[[step]]\nmodel = \"sf6_o2\"\nduration = 0.001\nion_flux = 10.0\netchant_flux = 4500.0\n"
        "oxygen_flux = 800.0\nion_exponent = 1000.0\nremoval_yield = 2.0\n"
        "[flux]\nrays = 20000\naveraging = 0.06\n[simplify]\nmethod = \"none\"\n");
    REQUIRE(test::run_program(folder.path, "run hole.toml -o out --quiet").exit_code == 0);
    const TriangleMesh surface = surface::read_mesh(folder.path / "out/surface_0001.vtp");
    const std::vector<double>& material = surface.triangle_attribute("material")->values;
    double floor = 0.0;
    for (std::size_t t = 0; t < material.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t])
            if (material[t] == 0.0) floor = std::max(floor, surface.vertices[v].x());
    CHECK(floor == Approx(0.175).margin(0.1 * 0.02));
}

TEST_CASE("a strip becomes the body that turns about the axis") {
    TriangleMesh strip;
    for (const auto& [r, z] :
         {std::pair(0.0, 1.0), std::pair(1.0, 1.0), std::pair(1.0, -1.0), std::pair(0.0, -1.0)}) {
        strip.vertices.emplace_back(r, -0.05, z);
        strip.vertices.emplace_back(r, 0.05, z);
    }
    // Clockwise in x and z, so that normals point outwards.
    for (std::uint32_t a = 0; a < 6; a += 2) {
        strip.triangles.push_back({a, a + 2, a + 3});
        strip.triangles.push_back({a, a + 3, a + 1});
    }
    strip.triangle_attributes.push_back({.name = "material", .values = {1, 1, 2, 2, 3, 3}});
    const TriangleMesh body = revolved(strip, 100);
    CHECK(enclosed_volume(body) == Approx(2.0 * kPi * (1.0 - 6.58 / 1e4)).epsilon(1e-5));
    CHECK(body.triangles.size() == 100 * (1 + 2 + 1));
    CHECK(body.triangle_attributes[0].values.size() == body.triangles.size());
}
