#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "surface/distance.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/integration/run_program.hpp"

// Whole runs on grids of several levels.
using namespace sidewall;
namespace fs = std::filesystem;

namespace {

nlohmann::json levels_summary(const fs::path& folder) {
    return nlohmann::json::parse(test::read_bytes(folder / "summary.json"));
}

// A film grown by a flux on a fin, on a wafer wide enough to have coarse cells beside it.
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

// A Bosch process with given speeds, so that only the grid makes a difference.
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

// Nothing moves in every eighth time step, at whose end the fine columns are chosen.
const std::string kPauses = R"([domain]
extent = [128.0, 32.0]
grid_spacing = 1.0
[advection]
cfl = 0.5
[[layer]]
material = "Si"
shape = "fin"
width = 9.0
height = 9.0
[[step]]
name = "cycle"
repeat = 5
[[step.steps]]
name = "wait"
model = "isotropic"
duration = 1.0
rate = 0.0
[[step.steps]]
name = "grow"
model = "isotropic"
duration = 3.5
rate = 1.0
deposit = "SiO2"
)";

// Runs a recipe on one level and on \p several, in folders of these names.
void run_on_levels(const fs::path& folder, const std::string& recipe, const std::string& several) {
    for (const std::string& levels : {std::string("1"), several})
        REQUIRE(test::run_program(folder, "run " + recipe + " --set grid.levels=" + levels + " -o " + levels)
                    .exit_code == 0);
}

surface::TwoSidedDistance between(const fs::path& folder, const std::string& several, const char* mesh) {
    return surface::two_sided_distance(surface::read_mesh(folder / "1" / mesh),
                                       surface::read_mesh(folder / several / mesh));
}

}  // namespace

TEST_CASE("the quick fin on a wide wafer ends alike on one and on two levels", "[slow]") {
    const test::Folder folder;
    run_on_levels(folder.path, test::config("quick/fin_on_wide_wafer.toml"), "2");
    const auto one = levels_summary(folder.path / "1"), two = levels_summary(folder.path / "2");
    REQUIRE(one["grid"]["levels"].size() == 1);
    REQUIRE(two["grid"]["levels"].size() == 2);
    CHECK(two["grid"]["levels"][1]["spacing"] == 5.0);
    CHECK(two["grid"]["levels"][0]["voxels"] < one["grid"]["levels"][0]["voxels"]);
    const double film = one["metrology"]["film_side"];
    CHECK(two["metrology"]["film_side"].get<double>() == Approx(film).epsilon(0.01));
    const surface::TwoSidedDistance apart = between(folder.path, "2", "surface_0002.vtp");
    CHECK(apart.mean < 0.02 * 2.5);
    CHECK(apart.max < 0.3 * 2.5);
}

TEST_CASE("cycles of film and etch without noise end the same on one level and on three", "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "cycles.toml", kCycles);
    run_on_levels(folder.path, "cycles.toml", "3");
    const auto one = levels_summary(folder.path / "1"), three = levels_summary(folder.path / "3");
    CHECK(2 * three["grid"]["levels"][0]["voxels"].get<int>() <
          one["grid"]["levels"][0]["voxels"].get<int>());
    for (const char* name : {"surface_0006.vtp", "interface_0006_0.vtp", "interface_0006_1.vtp"}) {
        INFO(name);
        CHECK(between(folder.path, "3", name).max < 0.02 * 0.0625);
    }
}

TEST_CASE("levels follow the front where every eighth time step stands still", "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "pauses.toml", kPauses);
    run_on_levels(folder.path, "pauses.toml", "2");
    const auto one = levels_summary(folder.path / "1"), two = levels_summary(folder.path / "2");
    CHECK(4 * two["grid"]["levels"][0]["voxels"].get<int>() <
          3 * one["grid"]["levels"][0]["voxels"].get<int>());
    for (std::size_t n = 0; n < two["steps"].size(); ++n)
        CHECK(two["steps"][n]["time_steps"] == (n % 2 == 0 ? 1 : 7));
    CHECK(between(folder.path, "2", "surface_0010.vtp").max < 0.02);
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
