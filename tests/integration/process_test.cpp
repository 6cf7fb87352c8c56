#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "app/process/simulation.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/integration/run_program.hpp"

// Whole processes: layers keep their volumes, steps stop where they should.
using namespace sidewall;

namespace {

struct Finished {
    app::RunResult result;
    double metrology(const std::string& name) const {
        return result.summary["metrology"][name].get<double>();
    }
    double time() const { return result.summary["time"].get<double>(); }
};

Finished run_text(const std::string& text, const std::vector<std::string>& overrides = {}) {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(text, "process.toml", overrides);
    return {app::run_recipe(recipe, {.output = folder.path, .quiet = true})};
}

Finished run_quick(const std::string& name, const std::vector<std::string>& overrides = {}) {
    const test::Folder folder;
    const app::Recipe recipe = app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/" + name, overrides);
    return {app::run_recipe(recipe, {.output = folder.path, .quiet = true})};
}

// Depth of the middle after a second at 0.8 of the flux there, which depends on the depth alone.
double depth_at(const std::function<double(double)>& flux) {
    double depth = 0.0;
    constexpr int kParts = 1000;
    for (int k = 0; k < kParts; ++k) {
        const double middle = depth + 0.5 * 0.8 * flux(depth) / kParts;
        depth += 0.8 * flux(middle) / kParts;
    }
    return depth;
}

const std::string kStrip = R"([domain]
extent = [2.0, 0.2]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
[simplify]
method = "none"
[output]
profiles = ["y=0"]
)";

}  // namespace

TEST_CASE("an etch stop thinner than a cell stops the etch and keeps its volume") {
    const Finished etch = run_text(kStrip + R"([[layer]]
material = "Si"
[[layer]]
material = "SiO2"
thickness = 0.02
[[layer]]
material = "PolySi"
thickness = 0.3
[[step]]
model = "directional"
duration = 5.0
directional = { Si = -0.5, PolySi = -0.5 }
)");
    CHECK(etch.metrology("depth") == Approx(-0.02).margin(1e-3));
    CHECK(etch.metrology("removed_volume_PolySi") == Approx(0.3 * 0.4).epsilon(0.01));
    CHECK(etch.metrology("removed_volume_SiO2") < 0.01 * 0.02 * 0.4);
    CHECK(etch.metrology("removed_volume_Si") < 1e-6);
}

TEST_CASE("a surface due when a step ends takes no time step for the rounding between their times") {
    // 7 * 0.1 and 8 * 0.1 are a bit more than the ends of the steps, 1 * 0.3 is a bit less than 0.1 + 0.1 +
    // 0.1.
    const auto counts = [](const std::vector<std::string>& durations, const std::string& every) {
        std::string text = kStrip + "every = " + every + "\n[[layer]]\nmaterial = \"Si\"\n";
        for (const std::string& duration : durations)
            text += "[[step]]\nmodel = \"isotropic\"\nrate = -0.1\nduration = " + duration + "\n";
        std::vector<int> found;
        const test::Folder folder;
        const auto steps =
            app::run_recipe(app::parse_recipe(text, "due.toml"), {.output = folder.path, .quiet = true})
                .summary["steps"];
        for (const auto& step : steps) found.push_back(step["time_steps"].get<int>());
        int surfaces = 0;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path))
            surfaces += entry.path().filename().string().starts_with("surface_") ? 1 : 0;
        found.push_back(surfaces);
        return found;
    };
    CHECK(counts({"0.7", "0.1", "0.2"}, "0.1") == std::vector{7, 1, 2, 11});
    CHECK(counts({"0.1", "0.1", "0.1"}, "0.3") == std::vector{1, 1, 1, 2});
}

TEST_CASE("steps end at the depth, the material and the thickness they name") {
    const std::string wafer =
        kStrip + "[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"SiO2\"\nthickness = 0.5\n";
    const Finished depth = run_text(
        wafer + "[[step]]\nmodel = \"isotropic\"\nduration = 9.0\nrate = -0.1\nstop_depth = 0.123\n");
    CHECK(depth.metrology("depth") == Approx(0.123).margin(0.05 * 0.05));
    CHECK(depth.time() == Approx(6.23).epsilon(0.01));
    const Finished material = run_text(
        wafer + "[[step]]\nmodel = \"isotropic\"\nduration = 9.0\nrate = -0.1\nstop_material = \"Si\"\n");
    CHECK(material.metrology("depth") == Approx(0.0).margin(0.5 * 0.05));
    CHECK(material.time() == Approx(5.0).epsilon(0.005));
    // A slow etch stops on a material that would etch fast.
    CHECK(run_text(wafer +
                   "[[step]]\nmodel = \"isotropic\"\nduration = 90.0\nrate = { SiO2 = -0.1, Si = -1.0 }\n"
                   "stop_material = \"Si\"\n")
              .metrology("removed_volume_Si") < 1e-3 * 0.5 * 0.4);
    const Finished film =
        run_text(wafer +
                 "[[step]]\nmodel = \"isotropic\"\nduration = 9.0\nrate = 0.1\ndeposit = \"W\"\n"
                 "stop_thickness = 0.321\n[metrology]\nmeasures = [\"film\"]\n");
    CHECK(film.metrology("film_top") == Approx(0.321).margin(0.05 * 0.05));
    CHECK(film.metrology("added_volume_W") == Approx(0.321 * 0.4).epsilon(0.01));
    // A stop that is not reached leaves the whole duration.
    CHECK(run_text(wafer + "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\nstop_depth = 5.0\n")
              .time() == 1.0);
}

namespace {

// Rate at which a step etches a blanket wafer of a material; less than 0 if it grows.
double blanket(const std::string& material, const std::string& step) {
    const std::string domain = R"([domain]
extent = [0.4, 0.4]
grid_spacing = 0.05
boundary = ["periodic", "periodic"]
[flux]
rays = 200000
[[layer]]
material = "Si"
top = 0.02
)";
    // The surface lies between nodes: on one marching cubes would shift it by a thousandth of a cell.
    const std::string layer =
        material == "Si" ? "" : "[[layer]]\nmaterial = \"" + material + "\"\nthickness = 0.5\n";
    return -run_text(domain + layer + "[[step]]\nduration = 1.0\n" + step).metrology("mean_rate");
}

}  // namespace

TEST_CASE("a blanket wafer moves at every model's formula", "[slow]") {
    // On a plane every particle arrives once: the mean flux is 1 to the last ray, and the noise of places
    // enters nonlinear models by its square.
    constexpr double kTolerance = 3e-3;
    // Ions of exactly 100 eV straight down.
    const std::string ions = "ion_exponent = 1e6\nion_energy_spread = 0.0\n";
    CHECK(blanket("Si", "model = \"single_particle\"\nrate = -0.2\nsticking = 0.3\n") ==
          Approx(0.2).epsilon(kTolerance));
    CHECK(blanket("Si",
                  "model = \"teos\"\nprecursors = [{ rate = 0.2, sticking = 0.4 }]\ndeposit = \"SiO2\"\n") ==
          Approx(-0.2).epsilon(kTolerance));
    CHECK(blanket("Si",
                  "model = \"multi_particle\"\nspecies = [{ name = \"a\", sticking = 0.5, rate = -0.15 }, "
                  "{ name = \"b\", kind = \"collimated\", rate = -0.1 }]\n") ==
          Approx(0.25).epsilon(kTolerance));
    CHECK(blanket("Si", "model = \"ion_beam\"\nrate = 0.2\ntilt_deg = 35\n" + ions) ==
          Approx(0.2).epsilon(kTolerance));
    CHECK(blanket("Si", "model = \"ion_beam\"\nrate = 0.2\ntilt_deg = 35\nazimuth_deg = 90\n" + ions) ==
          Approx(0.2).epsilon(kTolerance));

    // Models without particles: isotropic, directional, and crystals with a (100) surface.
    CHECK(blanket("Si", "model = \"isotropic\"\nrate = -0.2\n") == Approx(0.2).epsilon(kTolerance));
    CHECK(blanket("Si", "model = \"directional\"\ndirectional = -0.2\nisotropic = -0.05\n") ==
          Approx(0.25).epsilon(kTolerance));
    const std::string faces = "material = \"Si\"\nr100 = 0.2\nr110 = 0.3\nr111 = 0.01\nr311 = 0.3\n";
    CHECK(blanket("Si", "model = \"wet\"\n" + faces) == Approx(0.2).epsilon(kTolerance));
    CHECK(blanket("Si", "model = \"epitaxy\"\ndeposit = \"SiGe\"\n" + faces) ==
          Approx(-0.2).epsilon(kTolerance));

    // Rates and yields are those of a flat wafer, however wide the beam's angles and energies are.
    for (const std::string beam :
         {"", "ion_exponent = 10\n", "ion_energy = 25\n", "ion_exponent = 3\ntilt_deg = 50\n"})
        CHECK(blanket("Si", "model = \"ion_beam\"\nrate = 0.2\n" + beam) ==
              Approx(0.2).epsilon(2.0 * kTolerance));
    CHECK(blanket(
              "Si",
              "model = \"multi_particle\"\nspecies = [{ name = \"ion\", kind = \"ion\", rate = -0.2, yield = "
              "\"sputter\", source_exponent = 20 }]\n") == Approx(0.2).epsilon(2.0 * kTolerance));

    const auto plasma = [&](double e_sp, double a_sp, double a_ie, double beta_e) {
        const double root = std::sqrt(100.0), y_sp = a_sp * (root - std::sqrt(e_sp)),
                     y_ie = a_ie * (root - std::sqrt(15.0)), y_p = 3.0 * (root - std::sqrt(10.0));
        const double a = (300.0 + 20.0 * y_ie) / (beta_e * 4500.0), b = (0.04 + 10.0 * y_p) / 800.0;
        const double theta = 1.0 / (1.0 + a * (1.0 + 1.0 / b));
        return 1e-3 * (75.0 * theta + 10.0 * y_sp + 10.0 * theta * y_ie) / 5.02;
    };
    CHECK(blanket("Si", "model = \"sf6_o2\"\n" + ions) ==
          Approx(plasma(20.0, 0.0337, 7.0, 0.7)).epsilon(kTolerance));
    CHECK(blanket("Si", "model = \"hbr_o2\"\n" + ions) ==
          Approx(plasma(30.0, 0.5, 5.0, 0.1)).epsilon(kTolerance));

    // CF4/O2: three adsorbates; y_sp and y_ie of the material.
    const auto halogen = [](double x, double a_sp, double a_ie, double rho) {
        const double root = std::sqrt(100.0), y_sp = a_sp * (root - std::sqrt(20.0)),
                     y_ie = a_ie * (root - std::sqrt(15.0)), y_p = 3.0 * (root - std::sqrt(10.0)),
                     k = 300.0 * std::exp(0.4675 * x);
        const double f = 0.7 * 1800.0 / (k + 24.0 * y_ie),
                     o = 100.0 / (0.04 + 12.0 * y_p + (x > 0.0 ? 0.3 * 1800.0 : 0.0)),
                     c = 100.0 / (12.0 * y_p + 30.0), theta = f / (1.0 + f + o + c);
        return 1e-3 * (0.25 * k * theta + 12.0 * y_sp + 12.0 * theta * y_ie) / rho;
    };
    CHECK(blanket("Si", "model = \"cf4_o2\"\n" + ions) ==
          Approx(halogen(0.0, 0.0337, 7.0, 5.02)).epsilon(kTolerance));
    CHECK(blanket("SiGe", "model = \"cf4_o2\"\n" + ions) ==
          Approx(halogen(0.3, 0.03, 6.5, 4.8)).epsilon(kTolerance));

    // Fluorocarbon: much polymer precursor grows polymer, little lets the oxide be etched.
    const auto fluorocarbon = [](double polymer) {
        const double y_ie = 0.0361 * (std::sqrt(100.0) - std::sqrt(4.0)),
                     y_sp = 0.0139 * (std::sqrt(100.0) - std::sqrt(18.0)), removal = 56.0 * y_ie,
                     evaporation = 0.0027895 * 500.0 * std::exp(-0.168 / (8.617333262e-5 * 300.0));
        const double pe = 500.0 * 0.6 / (500.0 * 0.6 + removal),
                     p = std::min(1.0, polymer * 0.26 / (removal * pe + 1.0));
        if (p == 1.0) return -1e-3 * (polymer * 0.26 - removal * pe) / 2.2;
        const double e = 500.0 * 0.9 * (1.0 - p) / (2.0 * removal + 2.0 * evaporation + 500.0 * 0.9);
        return 1e-3 * (e * (evaporation + 56.0 * y_ie) + (1.0 - e) * 56.0 * y_sp) / 2.2;
    };
    REQUIRE(fluorocarbon(100.0) < 0.0);
    REQUIRE(fluorocarbon(30.0) > 0.0);
    for (const double polymer : {100.0, 30.0})
        CHECK(blanket("SiO2",
                      "model = \"fluorocarbon\"\ndeposit = \"Polymer\"\nenhanced_yield = { Si = 0.0 }\n"
                      "removal_yield = 0.0361\npolymer_flux = " +
                          std::to_string(polymer) + "\n" + ions) ==
              Approx(fluorocarbon(polymer)).epsilon(kTolerance));
}

TEST_CASE("a recipe in metres moves as one in micrometres does") {
    const Finished etch = run_text(R"([domain]
extent = [4e-7, 4e-7]
grid_spacing = 5e-8
length_unit = "m"
[[layer]]
material = "Si"
top = 2e-8
[[step]]
model = "single_particle"
rate = -1e-7
duration = 1.0
[flux]
rays = 20000
)");
    CHECK(etch.metrology("mean_rate") == Approx(-1e-7).epsilon(3e-3));
}

TEST_CASE("a gas changes nothing on a flat wafer, and starves the floor of a trench") {
    const std::string film = "model = \"single_particle\"\nrate = 0.2\nsticking = 0.3\ndeposit = \"SiO2\"\n";
    CHECK(blanket("Si", film + "pressure = 1e5\n") == Approx(-0.2).epsilon(3e-3));
    double before = 0.0;
    for (const std::string pressure : {"1e5", "1e4", "1.0"}) {
        const double bottom =
            run_quick("apcvd_trench.toml", {"step[0].duration=0.2", "step[0].pressure=" + pressure})
                .metrology("step_coverage_bottom");
        CHECK(bottom > 1.15 * before);
        before = bottom;
    }
}

TEST_CASE("epitaxy without rates grows one a time on <100>, on the crystal alone") {
    const std::string faces[] = {"r100", "r110", "r111", "r311"};
    std::string text = test::read_bytes(SIDEWALL_SOURCE_DIR "/configs/quick/fin_epitaxy.toml");
    for (const std::string& face : faces) {
        const std::size_t line = text.find(face + " = ");
        REQUIRE(line != std::string::npos);
        text.erase(line, text.find('\n', line) + 1 - line);
    }
    const Finished grown = run_text(text);
    // The fin's top is 10 above the silicon, its sides 7 above the oxide; 1.2 is grown, and facets cut the
    // corners.
    CHECK(grown.metrology("added_volume_SiGe") > 8.0);
    CHECK(grown.metrology("added_volume_SiGe") < 1.2 * (7.0 * 1.2 + 2.0 * 7.0 * 0.9));
    CHECK(grown.metrology("added_volume_SiO2") < 0.2);
    const std::string step = "model = \"epitaxy\"\nmaterial = \"Si\"\ndeposit = \"SiGe\"\n";
    CHECK(blanket("Si", step) == Approx(-1.0).epsilon(3e-3));
    CHECK(blanket("SiO2", step) == Approx(0.0).margin(1e-9));
}

TEST_CASE("below a square window along <100> no place is deeper than the floor") {
    const test::Folder folder;
    const auto outcome = test::run_program(
        folder.path, "run " + test::config("quick/wet_etch_pit.toml") +
                         " --set step[0].axis_100=[1.0,0.0,0.0] --set step[0].axis_010=[0.0,1.0,0.0] -o out");
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    double lowest = 0.0;
    for (const Vec3& p : surface::read_mesh(folder.path / "out" / "surface_0002.vtp").vertices)
        lowest = std::min(lowest, p.z());
    CHECK(lowest == Approx(-2.0 * 0.797).margin(0.1 * 0.25));  // a tenth of a cell
}

// The four walls meet 1.41 below the window after 1.8 minutes, and go on by 0.035 until the end.
TEST_CASE("a pit whose walls have met goes no deeper") {
    const std::string half = GENERATE("1.0", "1.1");
    const Finished pit =
        run_text(test::read_bytes(SIDEWALL_SOURCE_DIR "/configs/quick/wet_etch_pit.toml"),
                 {"domain.extent=[6.0, 6.0]", "step[0].duration=3.0",
                  "layer[1].polygons=[{points=[-" + half + ", -" + half + ", " + half + ", -" + half + ", " +
                      half + ", " + half + ", -" + half + ", " + half + "]}]"});
    const double tip = std::sqrt(2.0) * std::stod(half) + 0.035;
    CHECK(pit.metrology("depth") > tip - 1.5 * 0.25);  // the grid rounds the tip by a cell and a half
    CHECK(pit.metrology("depth") < tip);
}

TEST_CASE("selectivity is the ratio of blanket rates") {
    const std::string step =
        "model = \"single_particle\"\nrate = { Si = -0.3, Mask = -0.06 }\nsticking = 0.5\n";
    CHECK(blanket("Si", step) / blanket("Mask", step) == Approx(5.0).epsilon(3e-3));
}

TEST_CASE("step coverage grows as sticking falls") {
    double before = 0.0;
    for (const char* sticking : {"1.0", "0.3", "0.1", "0.02"}) {
        const Finished film =
            run_quick("teos_trench.toml",
                      {std::string("step[0].precursors=[{ rate = 0.2, sticking = ") + sticking + " }]"});
        const double bottom = film.metrology("step_coverage_bottom");
        CHECK(bottom > before);
        CHECK(bottom < 1.05);
        before = bottom;
    }
    CHECK(before > 0.8);
}

TEST_CASE(
    "atomic layers coat a blanket wafer at growth a cycle times coverage, a deep hole less at its floor") {
    const Finished flat = run_text(R"([domain]
extent = [40.0, 40.0]
grid_spacing = 5.0
length_unit = "nm"
[[layer]]
material = "Si"
[[step]]
model = "ald"
duration = 100.0
growth_per_cycle = 0.1
pulse = 0.5
purge = 1.5
precursor_flux = 400.0
sticking = 0.002
sites = 0.5
deposit = "HfO2"
[flux]
rays = 20000
[simplify]
method = "none"
[metrology]
measures = ["film"]
)");
    // 50 cycles, each to 1 - exp(-Gamma s t / s_0).
    CHECK(flat.metrology("film_top") == Approx(50 * 0.1 * (1.0 - std::exp(-0.8))).epsilon(0.02));
    const Finished hole = run_quick("ald_hole.toml");
    CHECK(hole.metrology("step_coverage_bottom") > 0.2);
    CHECK(hole.metrology("step_coverage_bottom") < 1.02);
}

TEST_CASE(
    "a film of a fifth to half a cell guards silicon and the mask flush with it, wherever the walls lie",
    "[slow]") {
    for (const double thickness : {0.01, 0.02, 0.025})
        for (int k = 0; k < 10; ++k) {
            const std::string width = "width = " + std::to_string(0.8 + 0.01 * k) + "\n";
            const Finished etch = run_text(kStrip + R"([[layer]]
material = "Si"
shape = "trench"
depth = 0.67
)" + width + R"([[layer]]
material = "Mask"
shape = "trench"
thickness = 0.2
)" + width + R"([[step]]
model = "conformal"
material = "Polymer"
thickness = )" + std::to_string(thickness) +
                                           R"(
[[step]]
model = "isotropic"
duration = 1.0
rate = { Si = -0.3 }
)");
            CAPTURE(thickness, width);
            // Without the film 0.05 um^3 would be removed.
            CHECK(etch.metrology("removed_volume_Si") < 1e-4);
        }
}

TEST_CASE("a vertical beam whose yield peaks at a slant takes its trench straight down") {
    const double dx = GENERATE(0.05, 0.025);
    const Finished mill = run_quick(
        "ion_beam_trench.toml", {"domain.extent=[1.0]", "domain.grid_spacing=" + std::to_string(dx),
                                 "step[0].tilt_deg=0", "flux.rays=50000", "step[0].redeposition_sticking=0"});
    // 0.005 um/s for 30 s in an opening of 0.5 um.
    CHECK(mill.metrology("removed_volume_Si") == Approx(0.075).epsilon(0.02));
    CHECK(mill.metrology("depth") == Approx(0.15).margin(0.25 * dx));
}

TEST_CASE("what a gas that sticks etches is as deep as the sky seen from its middle says") {
    // A mask 0.4 thick with an opening 1 wide; five or ten cells a radius. Depths scatter by 0.4 and
    // 0.8 % between seeds; coarser meshes or fluxes averaged over neighbours are 2 to 5 % off.
    const bool round = GENERATE(false, true);
    const double dx = GENERATE(0.1, 0.05);
    const std::string mask = round ? "shape = \"hole\"\nradius = 0.5" : "shape = \"trench\"\nwidth = 1.0";
    const Finished etch = run_text("[domain]\nextent = " + std::string(round ? "[1.6, 1.6]" : "[2.0]") + R"(
boundary = ["reflective", "reflective"]
grid_spacing = )" + std::to_string(dx) +
                                   R"(
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
thickness = 0.4
)" + mask + R"(
[[step]]
model = "single_particle"
duration = 1.0
sticking = 1.0
rate = { Si = -0.8, Mask = 0.0 }
[flux]
method = "monte-carlo"
accuracy = 0.005
[metrology]
measures = ["depth"]
)");
    const double exact = depth_at([&](double depth) {
        const double z = 0.4 + depth, radius = 0.5;
        return round ? radius * radius / (radius * radius + z * z) : radius / std::hypot(radius, z);
    });
    CHECK(etch.metrology("depth") == Approx(exact).epsilon(round ? 0.02 : 0.015));
}

// The mask hides the sky from what lies behind its edge, so that the front there is slow from the first
// moment. The area is that of the Hamilton-Jacobi equation of the fluxes in closed form, by a semi-Lagrangian
// scheme on three grids down to 1/200, extrapolated; that is known to 0.003.
TEST_CASE("what a gas that sticks etches under a mask is as much as its own shadow lets in") {
    const auto [dx, shift] =
        GENERATE(table<double, double>({{0.1, 0.0}, {0.1, 0.3}, {0.05, 0.0}, {0.05, 0.3}}));
    const Finished etch = run_text(R"([domain]
extent = [4.0]
grid_spacing = )" + std::to_string(dx) +
                                   R"(
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "trench"
thickness = 0.3
width = 1.0
position = [)" + std::to_string(shift * dx) +
                                   R"(, 0.0]
[[step]]
model = "single_particle"
duration = 0.75
sticking = 1.0
rate = { Si = -1.0, Mask = 0.0 }
[flux]
accuracy = 0.003
)");
    CHECK(etch.result.summary["volumes"]["Si"]["net"].get<double>() ==
          Approx(-0.558).margin(0.003 + 0.2 * dx));
}

TEST_CASE("half a trench at a reflective side measures as the whole one") {
    const auto measured = [](const std::string& extent, const std::string& window) {
        return run_text(R"([domain]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
extent = )" + extent +
                        R"(
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "mask"
thickness = 0.3
polygons = [{ points = )" +
                        window +
                        R"( }]
[[step]]
model = "directional"
duration = 1.0
directional = { Si = -0.8 }
isotropic = { Si = -0.1 }
[metrology]
measures = ["cd", "sidewall_angle", "bow", "undercut", "aspect_ratio"]
cd_depths = [0.3]
)");
    };
    const Finished whole = measured("[2.0, 0.2]", "[-0.4, -1.0, 0.4, -1.0, 0.4, 1.0, -0.4, 1.0]");
    CHECK(whole.metrology("cd_at_0.3") == Approx(0.94).margin(0.05));
    for (const char* side :
         {"[-0.9, -1.0, -0.1, -1.0, -0.1, 1.0, -0.9, 1.0]", "[0.1, -1.0, 0.9, -1.0, 0.9, 1.0, 0.1, 1.0]"}) {
        const Finished half = measured("[1.0, 0.2]", side);
        for (const std::string name : {"cd_at_0.3", "sidewall_angle", "bow", "undercut", "aspect_ratio"})
            CHECK(half.metrology(name) ==
                  Approx(whole.metrology(name)).margin(name == "sidewall_angle" ? 0.5 : 0.02));
    }
}

// Window 6 um wide, 4 min: the floor sinks by r100 t between walls at 54.74 degrees that move by r111 t.
// kGroove is etched in a slit, per length; kPyramid in a square.
namespace wet {
const double kDepth = 4.0 * 0.797, kAside = 4.0 * 0.005 * std::sqrt(1.5);
const double kTop = 6.0 + 2.0 * kAside, kBottom = kTop - std::sqrt(2.0) * kDepth;
const double kWall = kDepth * std::sqrt(1.5);  // the length of its slope
const double kGroove = 0.5 * (kTop + kBottom) * kDepth;
const double kPyramid = (kTop * kTop + kTop * kBottom + kBottom * kBottom) * kDepth / 3.0;

// KOH for 4 min through a slit 6 um wide.
Finished run_slit(const std::string& sides, const std::string& axes, double dx) {
    return run_text("[domain]\ntime_unit = \"min\"\n" + sides + R"([[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "trench"
thickness = 0.6
width = 6.0
[[step]]
model = "wet"
duration = 4.0
material = "Si"
r100 = 0.797
r110 = 1.455
r111 = 0.005
r311 = 1.436
)" + axes +
                        "[simplify]\nmethod = \"none\"\n"
                        "[metrology]\nmeasures = [\"depth\", \"sidewall_angle\", \"undercut\"]\n",
                    {"domain.grid_spacing=" + std::to_string(dx)});
}
}  // namespace wet

TEST_CASE("wet etching leaves the {111} walls of a groove, which hardly move", "[slow]") {
    for (const double dx : {0.2, 0.1}) {
        const Finished strip =
            wet::run_slit("extent = [10.0, 0.8]\nboundary = [\"reflective\", \"periodic\"]\n", "", dx);
        const double volume = strip.metrology("removed_volume_Si");
        CAPTURE(dx, volume / 0.8, wet::kGroove);
        CHECK(strip.metrology("sidewall_angle") == Approx(54.74).margin(0.5));
        // The rate is least at {111} alone, and the walls' normals are off by a part of a degree: on any grid
        // they move 0.008 um too far (0.062 um^2 in all at a spacing of 0.05). The rest is of first order.
        CHECK(std::abs(volume / 0.8 - wet::kGroove) < 2.0 * wet::kWall * (0.008 + 0.01 * dx));
    }
}

TEST_CASE("walls along <100> come to be vertical and recede below a mask as fast as the floor sinks") {
    // The etched part is a square beside either edge of the window: 0.797 um/min down and under the mask.
    const double exact = 4.0 * 0.797;
    for (const double dx : {0.2, 0.125}) {
        const Finished strip = wet::run_slit("extent = [16.0]\n",
                                             "axis_100 = [1.0, 0.0, 0.0]\naxis_010 = [0.0, 1.0, 0.0]\n", dx);
        CAPTURE(dx, strip.metrology("undercut"));
        CHECK(strip.metrology("depth") == Approx(exact).margin(0.01 * dx));
        CHECK(strip.metrology("undercut") == Approx(exact).epsilon(0.03));
        // First order: the foot is round over a few cells.
        CHECK(strip.metrology("sidewall_angle") == Approx(90.0).margin(20.0 * dx));
    }
}

TEST_CASE("the pit under a square window is an inverted pyramid, and its mask stays what it is", "[slow]") {
    const Finished coarse =
        run_quick("wet_etch_pit.toml", {"domain.grid_spacing=0.2", "step[0].duration=4.0"});
    CAPTURE(coarse.metrology("removed_volume_Si"), wet::kPyramid);
    CHECK(coarse.metrology("depth") == Approx(wet::kDepth).margin(0.1));
    CHECK(coarse.metrology("sidewall_angle") == Approx(54.74).margin(1.0));
    CHECK(std::abs(coarse.metrology("removed_volume_Si") - wet::kPyramid) <
          2.0 * (wet::kTop + wet::kBottom) * wet::kWall * 0.2);
    CHECK(std::abs(coarse.metrology("undercut")) < 0.2);
    // Half a cell along the mask's lower edge, 24 um long.
    CHECK(coarse.metrology("removed_volume_Mask") < 0.5 * 0.2 * 0.2 * 24.0);

    const test::Folder folder;
    const Finished pit{app::run_recipe(app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/wet_etch_pit.toml"),
                                       {.output = folder.path, .quiet = true})};
    const double dx = pit.result.summary["grid_spacing"].get<double>();
    CHECK(pit.metrology("depth") == Approx(wet::kDepth).margin(0.1 * dx));
    CHECK(pit.metrology("sidewall_angle") == Approx(54.74).margin(0.2));
    CHECK(pit.metrology("removed_volume_Si") == Approx(wet::kPyramid).epsilon(0.005));
    CHECK(pit.metrology("added_volume_Si") == 0.0);
    CHECK(pit.result.summary["time_steps"].get<int>() > 500);
    // Half a cell along the mask's lower edge here, too.
    CHECK(pit.metrology("added_volume_Mask") + pit.metrology("removed_volume_Mask") < 0.5 * dx * dx * 24.0);
    // No wall below the mask's edge counts as mask.
    const TriangleMesh surface = surface::read_mesh(folder.path / "surface_0004.vtp");
    const std::vector<double>& material = surface.triangle_attribute("material")->values;
    const auto height = [&](std::size_t t) { return triangle_centroid(surface, t).z(); };
    std::size_t floor = 0;
    for (std::size_t t = 0; t < material.size(); ++t)
        if (height(t) < height(floor)) floor = t;
    for (std::size_t t = 0; t < material.size(); ++t)
        if (height(t) < -0.5 * dx) REQUIRE(material[t] == material[floor]);
}

TEST_CASE("one trace a time step makes a film right to 0.3 %, as traces at every stage do", "[slow]") {
    // A trench that narrows by a cell a second; the film's volume against that of time steps ten times
    // shorter.
    const auto volume = [](const std::vector<std::string>& settings) {
        std::vector<std::string> all{"domain.extent=[10.0, 1.0]", "simplify.method=none", "flux.rays=200000",
                                     "advection.time_integration=rk3"};
        all.insert(all.end(), settings.begin(), settings.end());
        return run_quick("trench_deposition.toml", all).metrology("added_volume_SiO2");
    };
    const double exact = volume({"advection.cfl=0.05"});
    const double once = volume({}) / exact - 1.0, every = volume({"flux.stages=all"}) / exact - 1.0;
    CAPTURE(once, every);
    CHECK(std::abs(once) < 0.003);  // Euler's method: 0.016
    CHECK(std::abs(every) < 0.003);
}

TEST_CASE("a step far shorter than the process time before it etches its depth, stopped and resumed or not") {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(kStrip + R"([[layer]]
material = "Si"
[[step]]
model = "isotropic"
rate = 0.0
duration = 1e8
[[step]]
model = "isotropic"
rate = -1e7
duration = 1e-7
)",
                                                 "process.toml");
    const auto run = [&](const char* name, bool resume, int stop_at) {
        const auto observe = [&stop_at](const app::Moment& moment) {
            if (moment.summary == nullptr && stop_at-- == 0) throw Interrupted("");
        };
        return app::run_recipe(
            recipe, {.output = folder.path / name, .resume = resume, .quiet = true, .observe = observe});
    };
    const app::RunResult whole = run("whole", false, -1);
    CHECK(whole.summary["metrology"]["depth"].get<double>() == Approx(1.0).epsilon(1e-3));
    CHECK(whole.summary["steps"][1]["duration"].get<double>() == Approx(1e-7));
    CHECK(whole.summary["steps"][1]["time_steps"].get<int>() == 40);
    CHECK_THROWS_AS(run("parts", false, 20), Interrupted);
    const app::RunResult resumed = run("parts", true, -1);
    CHECK(resumed.summary["metrology"] == whole.summary["metrology"]);
    CHECK(resumed.surface.vertices == whole.surface.vertices);
}

TEST_CASE("warnings of a run go to the sink of its options, and nowhere else") {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(kStrip + R"([[layer]]
material = "Si"
[[step]]
model = "isotropic"
rate = -0.1
duration = 1.0
stop_depth = 0.0
)",
                                                 "process.toml");
    std::vector<std::string> lines;
    app::run_recipe(recipe, {.output = folder.path / "out",
                             .quiet = true,
                             .warn = [&](std::string_view line) { lines.emplace_back(line); }});
    REQUIRE(lines.size() == 1);
    CHECK(lines[0] == "step 1 (1 isotropic): its stop condition holds before it begins: it does nothing");
    std::ofstream(folder.path / "held.toml") << app::effective_recipe(recipe);
    CHECK(test::run_program(folder.path, "run held.toml -o quiet --quiet").output.empty());
    CHECK(test::run_program(folder.path, "run held.toml -o told").output.find(lines[0]) != std::string::npos);
}
