#include <nlohmann/json.hpp>
#include <set>

#include "app/process/simulation.hpp"
#include "surface/distance.hpp"
#include "tests/integration/run_program.hpp"

// [flux] method in whole runs.
using namespace sidewall;
using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

// A film in a deep hole; the sticking is so low that re-emission matters.
const std::string kTwoMethods = R"(
[domain]
extent = [1.0, 1.0]
grid_spacing = 0.125
[[layer]]
material = "Si"
shape = "hole"
radius = 0.375
depth = 2.0
[[step]]
repeat = 2
[[step.steps]]
model = "single_particle"
rate = 1.0
sticking = 0.05
duration = 0.1
deposit = "SiO2"
[[step.steps]]
name = "clean"
model = "multi_particle"
duration = 0.05
species = [ { name = "gas", sticking = 0.1, rate = -0.2 }, { name = "ion", kind = "ion", rate = -0.1 } ]
[[step]]
model = "single_particle"
rate = 1.0
sticking = 0.02
duration = 0.09
deposit = "SiO2"
[flux]
rays = 10000
)";

nlohmann::json summary(const fs::path& folder) {
    return nlohmann::json::parse(read_bytes(folder / "summary.json"));
}

// Checks that surfaces, profiles and the timeline are equal byte for byte.
void check_same(const fs::path& a, const fs::path& b) {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(a)) {
        const std::string extension = entry.path().extension().string();
        if (!std::set<std::string>{".vtp", ".csv", ".pvd"}.contains(extension)) continue;
        INFO(entry.path());
        CHECK(read_bytes(entry.path()) == read_bytes(b / entry.path().filename()));
        ++count;
    }
    CHECK(count > 3);
}

}  // namespace

TEST_CASE("a film grown with radiosity is Monte Carlo's within the errors of both") {
    const Folder folder;
    std::vector<app::RunResult> runs;
    std::vector<double> errors;
    for (const std::string method : {"monte-carlo", "radiosity"}) {
        runs.push_back(app::run_recipe(
            app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/hole_deposition.toml",
                             {"flux.method=" + method, "flux.rays=30000", "output.every=end"}),
            {.output = folder.path / method, .quiet = true}));
        const auto& flux = runs.back().summary["flux"][0];
        CHECK(flux["species"] == "neutral");
        CHECK(flux["method"] == method);
        errors.push_back(flux["relative_error"].get<double>());
    }
    CHECK(errors[1] < errors[0]);
    // The film is the flux times the duration: its mean is off by no more than the mean flux is.
    const auto film = [&](std::size_t run) {
        return runs[run].summary["metrology"]["added_volume_SiO2"].get<double>();
    };
    CHECK(std::abs(film(0) - film(1)) < (errors[0] + errors[1]) * film(0));
    // The film's mean thickness is off by no more, either; its area is about the surface's. In addition
    // meshes of different runs differ by a hundredth of a grid spacing.
    double area = 0.0;
    for (std::size_t t = 0; t < runs[0].surface.triangles.size(); ++t)
        area += triangle_area(runs[0].surface, t);
    const double thickness = film(0) / area;
    const double mean = surface::two_sided_distance(runs[0].surface, runs[1].surface).mean;
    CHECK(mean < (errors[0] + errors[1]) * thickness + 0.01 * 0.2);
}

TEST_CASE("a run with radiosity has the same bits on any number of threads and when it is resumed") {
    const Folder folder;
    test::write_bytes(folder.path / "recipe", kTwoMethods);
    std::string shorter = kTwoMethods;
    shorter.replace(shorter.rfind("duration = 0.09"), 15,
                    "duration = 0.045");  // within the last step
    for (const std::string method : {"radiosity", "auto"}) {
        const std::string set = " --quiet --set flux.method=" + method + " -o ";
        REQUIRE(run_program(folder.path, "run recipe --threads 1" + set + "one").exit_code == 0);
        REQUIRE(run_program(folder.path, "run recipe --threads 2" + set + "two").exit_code == 0);
        check_same(folder.path / "one", folder.path / "two");
        test::write_bytes(folder.path / "recipe", shorter);
        REQUIRE(run_program(folder.path, "run recipe --threads 2" + set + "part").exit_code == 0);
        test::write_bytes(folder.path / "recipe", kTwoMethods);
        const auto resumed = run_program(folder.path, "run recipe --resume --threads 2" + set + "part");
        INFO(resumed.output);
        REQUIRE(resumed.exit_code == 0);
        check_same(folder.path / "one", folder.path / "part");
        for (const char* run : {"one", "two", "part"}) fs::remove_all(folder.path / run);
    }
}

TEST_CASE(
    "auto says once what it took for the steps that are alike, radiosity what it leaves to Monte Carlo") {
    const Folder folder;
    test::write_bytes(folder.path / "recipe", kTwoMethods);
    const auto told = run_program(folder.path, "run recipe --set flux.method=auto -o out");
    INFO(told.output);
    REQUIRE(told.exit_code == 0);
    // Two different steps have a neutral, at sticking 0.05 and 0.02: one line, or one for each method.
    const std::size_t traced = test::count(told.output, "neutral by monte-carlo"),
                      solved = test::count(told.output, "neutral by radiosity");
    CHECK(traced <= 1);
    CHECK(solved <= 1);
    CHECK(traced + solved >= 1);
    CHECK(test::count(told.output, "gas by ") == 1);
    CHECK(test::count(told.output, "ion by monte-carlo (") == 1);
    const auto flux = summary(folder.path / "out")["flux"];
    REQUIRE(flux.size() == 1);
    CHECK(flux[0]["species"] == "neutral");
    CHECK(told.output.find("neutral by " + flux[0]["method"].get<std::string>()) != std::string::npos);

    const auto asked = run_program(folder.path, "run recipe --quiet --set flux.method=radiosity -o all");
    INFO(asked.output);
    REQUIRE(asked.exit_code == 0);
    CHECK(test::count(asked.output, "flux.method = \"radiosity\": monte-carlo traces ion (") == 1);
    CHECK(test::count(asked.output, " by ") == 0);
    CHECK(summary(folder.path / "all")["flux"][0]["method"] == "radiosity");

    const auto checked = run_program(folder.path, "check recipe --set flux.method=radiosity");
    INFO(checked.output);
    CHECK(checked.output.find("method = \"radiosity\"") != std::string::npos);
    CHECK(checked.output.find("#   fluxes     neutral by radiosity\n") != std::string::npos);
    CHECK(checked.output.find("gas by radiosity; ion by monte-carlo (") != std::string::npos);
    CHECK(run_program(folder.path, "check recipe --set flux.method=monte-carlo").output.find("#   fluxes") ==
          std::string::npos);
}

TEST_CASE("a method there is not and a memory that holds nothing are refused by name") {
    const Folder folder;
    test::write_bytes(folder.path / "recipe", kTwoMethods + "method = \"radiositi\"\n");
    const auto method = run_program(folder.path, "run recipe -o out");
    INFO(method.output);
    CHECK(method.exit_code == 2);
    CHECK(method.output.find("flux.method = \"radiositi\": ") != std::string::npos);
    CHECK(method.output.find("radiosity") != std::string::npos);
    CHECK(method.output.find("monte-carlo") != std::string::npos);
    for (const char* value : {"0", "-1", "nan", "\"much\""}) {
        test::write_bytes(folder.path / "recipe", kTwoMethods + "memory = " + value + "\n");
        const auto memory = run_program(folder.path, "run recipe -o out");
        INFO(memory.output);
        CHECK(memory.exit_code == 2);
        CHECK(memory.output.find("recipe:31: flux.memory = ") != std::string::npos);
    }
    CHECK_FALSE(fs::exists(folder.path / "out"));
}
