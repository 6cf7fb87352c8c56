#include <nlohmann/json.hpp>

#include "app/process/simulation.hpp"
#include "surface/distance.hpp"
#include "surface/error.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/integration/run_program.hpp"

using namespace sidewall;
using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

constexpr double kSpacing = 0.1;
const std::string kStartDomain = R"(
[domain]
extent = [2.0, 1.0]
grid_spacing = 0.1
)";
const std::string kMaterial = R"(
[[material]]
name = "Oxynitride"
)";
const std::string kTrench = kMaterial + R"(
[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 0.5
taper_deg = 5.0
[[layer]]
material = "Oxynitride"
shape = "trench"
width = 1.0
thickness = 0.2
)";
const std::string kDeposit = R"(
[[step]]
model = "isotropic"
rate = 1.0
duration = 0.2
deposit = "SiO2"
)";
const std::string kStartEtch = R"(
[[step]]
model = "isotropic"
rate = -1.0
duration = 0.3
)";

app::RunResult run(const std::string& text, const fs::path& output) {
    // The file name serves messages, and [start] is sought in its folder.
    return app::run_recipe(app::parse_recipe(text, (output.parent_path() / "start.toml").string()),
                           {.output = output, .quiet = true});
}

std::string start(const std::string& keys) {
    return kStartDomain + kMaterial + "[start]\n" + keys;
}

}  // namespace

TEST_CASE("a recipe goes on from the end of another run as if their steps were one recipe's") {
    const Folder folder;
    run(kStartDomain + kTrench + kDeposit, folder.path / "first");
    const app::RunResult whole = run(kStartDomain + kTrench + kDeposit + kStartEtch, folder.path / "whole");
    const app::RunResult second = run(start("from = \"first\"") + kStartEtch, folder.path / "second");
    // Process times begin anew and round differently: a float of the grid may differ in its last bit.
    const surface::TwoSidedDistance d = surface::two_sided_distance(second.surface, whole.surface);
    CHECK(d.max < 1e-5 * kSpacing);
    CHECK(second.summary["metrology"]["removed_volume_SiO2"] > 0.0);
    CHECK(second.summary["metrology"]["added_volume_SiO2"] == 0.0);
    // The recipe that the run wrote gives the same run again.
    const auto again = run_program(folder.path, "run second/recipe.toml -o second --quiet");
    INFO(again.output);
    CHECK(again.exit_code == 0);
}

TEST_CASE("a recipe starts from any surface that another run saved, by time or by step") {
    const Folder folder;
    run(kStartDomain + kTrench + kDeposit + kStartEtch + kDeposit, folder.path / "first");
    const auto shown = [&](const std::string& name) { return surface::read_mesh(folder.path / name); };
    const auto starts_at = [&](const std::string& keys, const std::string& there) {
        INFO(keys);
        run(start("from = \"first\"\n" + keys) + kStartEtch, folder.path / "second");
        // Marching cubes cut off an edge in its cell, by ab / sqrt(a^2 + b^2) of crossings at a, b <= dx. It
        // is cut once more; elsewhere nothing moves. Less than a seventh of the vertices lies at edges.
        const surface::TwoSidedDistance d =
            surface::two_sided_distance(shown("second/surface_0000.vtp"), shown("first/" + there));
        CHECK(d.max < 0.71 * kSpacing);
        CHECK(d.mean < 0.1 * kSpacing);
        for (const char* k : {"0", "1"})
            CHECK(fs::exists(folder.path / ("second/interface_0000_" + std::string(k) + ".vtp")));
        fs::remove_all(folder.path / "second");
    };
    starts_at("time = 0", "surface_0000.vtp");
    starts_at("time = 0.2", "surface_0001.vtp");
    starts_at("step = 1", "surface_0001.vtp");
    starts_at("step = 2", "surface_0002.vtp");
    starts_at("step = 3", "surface_0003.vtp");
    starts_at("time = 0.7", "surface_0003.vtp");
}

TEST_CASE("what forbids to start from another run is named") {
    const Folder folder;
    run(kStartDomain + kTrench + kDeposit + kStartEtch, folder.path / "first");
    const auto refuses = [&](const std::string& text, const std::string& told) {
        CHECK_THROWS_WITH(run(text, folder.path / "second"), Catch::Contains(told));
    };
    refuses(start("from = \"none\"") + kStartEtch, "start.from = \"none\": no run to start from");
    refuses(start("from = \"first\"\ntime = 0.1") + kStartEtch,
            "no surface at start.time = 0.1; it did at 0, 0.2, 0.5 (s)");
    refuses(start("from = \"first\"\nstep = 3") + kStartEtch,
            "no surface at the end of start.step = 3; it did of 1, 2");
    refuses(start("from = \"first\"\nstep = 1\ntime = 0") + kStartEtch, "give time or step, not both");
    refuses(kStartDomain + "[start]\nfrom = \"first\"" + kTrench + kStartEtch,
            "a run that starts from another has its layers");
    refuses(kStartDomain + "[start]\nfrom = \"first\"" + kStartEtch,
            "material Oxynitride: add a [[material]]");
    const auto changed = [](std::string text, const std::string& from, const std::string& to) {
        return text.replace(text.find(from), from.size(), to);
    };
    refuses(changed(start("from = \"first\"") + kStartEtch, "spacing = 0.1", "spacing = 0.2"),
            "domain.grid_spacing = 0.2 (there 0.1)");
    refuses(changed(start("from = \"first\"") + kStartEtch, "[domain]", "[domain]\nlength_unit = \"nm\""),
            "length_unit is um, and this recipe's nm");
    CHECK_THROWS_WITH(run(start("from = \"first\"") + kStartEtch, folder.path / "first"),
                      Catch::Contains("start.from is the folder to write to"));
    REQUIRE(fs::remove(folder.path / "first/interface_0000_0.vtp"));
    refuses(start("from = \"first\"\ntime = 0") + kStartEtch, "interface_0000_0.vtp");
    REQUIRE(fs::remove(folder.path / "first/summary.json"));
    refuses(start("from = \"first\"") + kStartEtch, "that run has not ended");
}
