#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "surface/distance.hpp"
#include "surface/mesh_io.hpp"
#include "tests/integration/program.hpp"

// Whole runs on grids of several levels.
using namespace sidewall;
namespace fs = std::filesystem;

namespace {

nlohmann::json levels_summary(const fs::path& folder) {
    return nlohmann::json::parse(test::read_bytes(folder / "summary.json"));
}

// A fin under a film with a flux, on a wafer wide enough to be coarse beside it.
const std::string kFin = R"([domain]
extent = [64.0, 16.0]
grid_spacing = 0.25
boundary = ["reflective", "periodic"]
[grid]
levels = 2
[[layer]]
material = "Si"
shape = "fin"
width = 3.0
height = 3.0
[[step]]
name = "film"
model = "single_particle"
duration = 1.0
rate = 1.0
sticking = 0.5
deposit = "SiO2"
[flux]
rays = 400_000
[metrology]
measures = ["film"]
)";
const std::string kPolish = R"([[step]]
name = "polish"
model = "planarize"
height = 3.2
[[step]]
name = "etch"
model = "isotropic"
duration = 0.5
rate = { SiO2 = -1.0 }
)";

// A Bosch process whose speeds are given, so that what differs is the grid's alone.
const std::string kCycles = R"([domain]
extent = [16.0, 2.0]
grid_spacing = 0.0625
[[layer]]
material = "Si"
[[layer]]
material = "Mask"
shape = "trench"
thickness = 0.6
width = 2.0
[[step]]
name = "cycle"
repeat = 3
[[step.steps]]
name = "deposit"
model = "isotropic"
duration = 5.0
deposit = "Polymer"
rate = 0.008
[[step.steps]]
name = "etch"
model = "directional"
duration = 11.0
directional = { Polymer = -0.008, Si = -0.012, Mask = -0.0006 }
isotropic = { Polymer = -0.001, Si = -0.03, Mask = -0.0005 }
)";

}  // namespace

TEST_CASE("the quick fin on a wide wafer ends alike on one and on two levels", "[slow]") {
    const test::Folder folder;
    for (const std::string levels : {"1", "2"})
        REQUIRE(test::run_program(folder.path, "run " + test::config("quick/fin_on_wide_wafer.toml") +
                                                   " --set grid.levels=" + levels + " -o " + levels)
                    .exit_code == 0);
    const auto one = levels_summary(folder.path / "1"), two = levels_summary(folder.path / "2");
    REQUIRE(one["grid"]["levels"].size() == 1);
    REQUIRE(two["grid"]["levels"].size() == 2);
    CHECK(two["grid"]["levels"][1]["spacing"] == 5.0);
    CHECK(two["grid"]["levels"][0]["voxels"] < one["grid"]["levels"][0]["voxels"]);
    const double film = one["metrology"]["film_side"];
    CHECK(two["metrology"]["film_side"].get<double>() == Approx(film).epsilon(0.01));
    const auto surface = [&](const char* run) {
        return surface::read_mesh(folder.path / run / "surface_0002.vtp");
    };
    const surface::TwoSidedDistance between = surface::two_sided_distance(surface("1"), surface("2"));
    CHECK(between.mean < 0.02 * 2.5);
    CHECK(between.max < 0.3 * 2.5);
}

TEST_CASE("cycles of film and etch without noise end the same on one level and on three", "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "cycles.toml", kCycles);
    for (const std::string levels : {"1", "3"})
        REQUIRE(
            test::run_program(folder.path, "run cycles.toml --set grid.levels=" + levels + " -o " + levels)
                .exit_code == 0);
    const auto one = levels_summary(folder.path / "1"), three = levels_summary(folder.path / "3");
    CHECK(2 * three["grid"]["levels"][0]["voxels"].get<int>() <
          one["grid"]["levels"][0]["voxels"].get<int>());
    for (const char* name : {"surface_0006.vtp", "interface_0006_0.vtp", "interface_0006_1.vtp"}) {
        const auto mesh = [&](const char* run) { return surface::read_mesh(folder.path / run / name); };
        const surface::TwoSidedDistance between = surface::two_sided_distance(mesh("1"), mesh("3"));
        INFO(name);
        CHECK(between.max < 0.02 * 0.0625);
    }
}

TEST_CASE("a run on two levels goes on from its checkpoint to the same surface", "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "short.toml", kFin);
    test::write_bytes(folder.path / "long.toml", kFin + kPolish);
    REQUIRE(test::run_program(folder.path, "run long.toml -o whole --threads 1").exit_code == 0);
    REQUIRE(test::run_program(folder.path, "run short.toml -o parts").exit_code == 0);
    REQUIRE(test::run_program(folder.path, "run long.toml -o parts --resume").exit_code == 0);
    const auto whole = levels_summary(folder.path / "whole"), parts = levels_summary(folder.path / "parts");
    CHECK(whole["grid"] == parts["grid"]);
    CHECK(whole["metrology"] == parts["metrology"]);
    const std::string last = "surface_000" + std::to_string(whole["steps"].size()) + ".vtp";
    CHECK(test::read_bytes(folder.path / "whole" / last) == test::read_bytes(folder.path / "parts" / last));
}
