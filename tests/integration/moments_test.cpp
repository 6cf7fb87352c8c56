#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "app/process/simulation.hpp"
#include "app/results/result.hpp"
#include "tests/integration/run_program.hpp"

// The wafer saved at the end of every step, and what can be asked of it.
using namespace sidewall;
using nlohmann::json;

namespace {

// A trench is etched into silicon through a mask, the mask is stripped, the trench lined; then two cycles of
// a loop.
const std::string kMoments = R"([domain]
extent = [2.0, 0.2]
grid_spacing = 0.1
boundary = ["reflective", "periodic"]
[simplify]
method = "none"
[[layer]]
material = "Si"
[[step]]
name = "spin & bake"
model = "mask"
material = "Resist"
thickness = 0.4
shape = "polygons"
polygons = [{ points = [-0.5, -1.0, 0.5, -1.0, 0.5, 1.0, -0.5, 1.0] }]
[[step]]
name = "etch"
model = "directional"
duration = 1.0
directional = { Si = -0.5 }
[[step]]
name = "strip"
model = "strip"
material = "Resist"
[[step]]
name = "liner"
model = "isotropic"
duration = 1.0
rate = 0.1
deposit = "SiO2"
[[step]]
repeat = 2
[[step.steps]]
name = "grow"
model = "isotropic"
duration = 0.5
rate = 0.1
deposit = "SiO2"
[metrology]
measures = ["depth", "film"]
)";

void run_moments(const test::Folder& folder, const std::vector<std::string>& overrides = {}) {
    test::write_bytes(folder.path / "recipe.toml", kMoments);
    app::run_recipe(app::parse_recipe(kMoments, (folder.path / "recipe.toml").string(), overrides),
                    {.output = folder.path / "out", .quiet = true});
}

json summary(const test::Folder& folder) {
    return json::parse(test::read_bytes(folder.path / "out/summary.json"));
}

bool says(const test::Outcome& outcome, const std::string& words) {
    return outcome.output.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("the end of every step is a row of the timeline and has its measures in the summary") {
    const test::Folder folder;
    run_moments(folder);
    const json result = summary(folder);
    const json& steps = result["steps"];
    REQUIRE(steps.size() == 6);
    const double depth[] = {0.0, 0.5, 0.5, 0.4, 0.35, 0.3}, film[] = {0.4, 0.4, 0.0, 0.1, 0.15, 0.2};
    const double time[] = {0.0, 1.0, 1.0, 2.0, 2.5, 3.0};
    const app::TextTable timeline = app::read_text_table(folder.path / "out/timeline.csv");
    std::vector<std::vector<std::string>> ends;
    for (const auto& row : timeline.rows)
        if (row[timeline.column("dt").value()].empty()) ends.push_back(row);
    REQUIRE(ends.size() == 6);
    for (std::size_t k = 0; k < 6; ++k) {
        INFO(k);
        CHECK(steps[k]["time"] == time[k]);
        CHECK(steps[k]["measures"]["depth"].get<double>() == Approx(depth[k]).margin(0.005));
        CHECK(ends[k][0] == std::to_string(k + 1));
        CHECK(steps[k]["name"] == ends[k][1]);
        CHECK(std::stod(ends[k][timeline.column("time").value()]) == time[k]);
        CHECK(std::stod(ends[k][timeline.column("depth").value()]) ==
              Approx(steps[k]["measures"]["depth"].get<double>()).epsilon(1e-5));
        if (k != 3) continue;  // only the liner's thickness is given by its step
        CHECK(steps[k]["measures"]["film_top"].get<double>() == Approx(film[k]).margin(0.002));
    }
    CHECK(steps[5]["measures"]["depth"] == result["metrology"]["depth"]);
}

TEST_CASE("every = \"end\" keeps the wafer after every step, those that take no time, too") {
    const test::Folder folder;
    run_moments(folder);
    const std::vector<app::SavedSurface> saved = app::saved_surfaces(folder.path / "out");
    std::vector<std::string> after;
    for (const app::SavedSurface& surface : saved) after.push_back(surface.after);
    CHECK(after == std::vector<std::string>{"1 spin & bake", "2 etch", "3 strip", "4 liner",
                                            "5.1 grow (cycle 1 of 2)", "5.1 grow (cycle 2 of 2)"});
    // Where the resist still stands the highest point is its top.
    const auto top = [&](const std::string& step) {
        return bounding_box(app::read_saved(folder.path / "out", app::saved_after(saved, step)).surface)
            .max.z();
    };
    CHECK(top("etch") == Approx(0.4).margin(0.005));
    CHECK(top("strip") == Approx(0.0).margin(0.005));
    CHECK(top("4") == Approx(0.1).margin(0.005));
    CHECK(top("grow") == Approx(0.2).margin(0.005));
    CHECK(top("5.1 grow (cycle 1 of 2)") == Approx(0.15).margin(0.005));
    CHECK_THROWS_WITH(app::saved_after(saved, "ash"), Catch::Matchers::Contains("--step ash") &&
                                                          Catch::Matchers::Contains("2 etch, 3 strip"));
}

TEST_CASE("inspect, render, export and report take a step or a time of a run's folder") {
    const test::Folder folder;
    run_moments(folder);
    const auto inspected = [&](const std::string& options) {
        const auto outcome = test::run_program(folder.path, "inspect out --json - " + options);
        INFO(outcome.output);
        REQUIRE(outcome.exit_code == 0);
        return json::parse(outcome.output);
    };
    const json etch = inspected("--step etch");
    CHECK(etch["measures"]["depth"]["value"].get<double>() == Approx(0.5).margin(0.005));
    CHECK(etch["finished"] == true);
    CHECK(inspected("--time 2")["measures"]["depth"]["value"].get<double>() == Approx(0.4).margin(0.005));
    CHECK(inspected("--step etch --measure wall_Resist_at_-0.2")["measures"].size() == 1);
    // The wafer is rebuilt from its meshes, which makes an error of a hundredth of a cell.
    CHECK(inspected("--step strip --measure cd_at_0.2")["measures"]["cd_at_0.2"]["value"].get<double>() ==
          Approx(1.0).margin(0.005));
    // Figures that do not exist are null, and step coverages absent, wherever JSON lists figures.
    const json strip =
        json::parse(test::read_bytes(folder.path / "out/summary.json"))["steps"][2]["measures"];
    for (const json& measures : {inspected("--step strip")["measures"],
                                 inspected("--step strip --measure film")["measures"], strip}) {
        INFO(measures);
        CHECK(measures.contains("film_side"));
        CHECK_FALSE(measures.contains("step_coverage_side"));
    }
    CHECK(strip["film_side"].is_null());
    CHECK(says(test::run_program(folder.path, "inspect out --step strip"), "step_coverage_side     none"));
    for (const char* command :
         {"render out -o etch.png --step etch --size 100x80", "export out -o etch.stl --step etch",
          "export out -o etch.csv --step strip --cut y=0", "report out -o etch.html --step liner"}) {
        const auto outcome = test::run_program(folder.path, command);
        INFO(outcome.output);
        CHECK(outcome.exit_code == 0);
    }
    CHECK(test::read_bytes(folder.path / "etch.csv").starts_with("x"));
    for (const char* command : {"render out -o a.png --step ash", "export out -o a.stl --step ash",
                                "inspect out --step ash", "report out -o a.html --step ash"}) {
        const auto outcome = test::run_program(folder.path, command);
        CHECK(outcome.exit_code == 2);
        CHECK(says(outcome, "--step ash"));
    }
    CHECK(test::run_program(folder.path, "inspect etch.stl --step etch").exit_code == 2);
    CHECK(test::run_program(folder.path, "inspect out --step etch --time 1").exit_code == 2);
}

TEST_CASE("a run's profiles are those that export cuts from its surfaces, byte by byte") {
    const test::Folder folder;
    run_moments(folder, {"output.profiles=[\"y=0\", \"y=0.03\"]"});
    for (const auto& [step, number] : {std::pair("1", "0000"), {"etch", "0001"}, {"liner", "0003"}})
        for (const auto& [cut, suffix] : {std::pair("y=0", ""), {"y=0.03", "_1"}}) {
            const auto outcome = test::run_program(
                folder.path, fmt::format("export out -o cut.csv --cut {} --step {}", cut, step));
            INFO(outcome.output);
            REQUIRE(outcome.exit_code == 0);
            CHECK(test::read_bytes(folder.path / "cut.csv") ==
                  test::read_bytes(folder.path / fmt::format("out/profile_{}{}.csv", number, suffix)));
        }
}

TEST_CASE("an unfinished run can be drawn and measured, and is said to be unfinished") {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(kMoments, "moments.toml");
    bool stop = false;
    const auto observe = [&](const app::Moment& moment) { stop = moment.state.process_time() > 0.5; };
    CHECK_THROWS_AS(
        app::run_recipe(
            recipe,
            {.output = folder.path / "out", .quiet = true, .stop = [&] { return stop; }, .observe = observe}),
        Interrupted);
    const auto outcome = test::run_program(folder.path, "inspect out --json -");
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const json found = json::parse(outcome.output);
    CHECK(found["finished"] == false);
    const double time = found["metadata"]["time"].get<double>();
    CHECK(time > 0.5);
    CHECK(found["measures"]["depth"]["value"].get<double>() == Approx(0.5 * time).margin(0.005));
    for (const char* command : {"inspect out", "render out -o a.png --size 100x80", "export out -o a.stl",
                                "report out -o a.html"}) {
        const auto said = test::run_program(folder.path, command);
        INFO(said.output);
        CHECK(said.exit_code == 0);
        if (std::string(command).starts_with("report")) continue;  // a report says it on its page
        CHECK(says(said, "the run has not ended"));
    }
    CHECK(std::abs(-bounding_box(app::read_result(folder.path / "a.stl").surface).min.z() - 0.5 * time) <
          0.005);
}
