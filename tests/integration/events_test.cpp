#include <signal.h>

#include <fmt/format.h>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "app/process/simulation.hpp"
#include "tests/integration/run_program.hpp"

// Events that a run reports at once and in its summary.
using namespace sidewall;
using nlohmann::json;

namespace {

const std::string kEventStrip = R"([domain]
extent = [2.0, 0.2]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
[simplify]
method = "none"
[[layer]]
material = "Si"
)";

// Silicon etches under a line of mask, 0.2 thick and 0.6 wide.
const std::string kUndercut = kEventStrip + R"([[layer]]
material = "Mask"
shape = "mask"
thickness = 0.2
openings = false
polygons = [{ points = [-0.3, -1.0, 0.3, -1.0, 0.3, 1.0, -0.3, 1.0] }]
[[step]]
name = "undercut"
model = "isotropic"
rate = { Si = -0.5 }
duration = )";

json run_events(const std::string& text, const std::vector<std::string>& overrides = {}) {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(text, "events.toml", overrides);
    return app::run_recipe(recipe, {.output = folder.path, .quiet = true}).summary;
}

std::vector<json> events(const json& summary, const std::string& kind) {
    std::vector<json> list;
    for (const json& event : summary["events"])
        if (event["kind"] == kind) list.push_back(event);
    return list;
}

}  // namespace

TEST_CASE("a mask undercut from both sides is told once, when it hangs, and so is the void that closes") {
    const json summary = run_events(kUndercut + "1.2\n");
    const auto hanging = events(summary, "piece-detached");
    REQUIRE(summary["events"].size() == 1);
    REQUIRE(hanging.size() == 1);
    // The fronts meet after 0.6 s; the ridge between them is lost within two cells of silicon.
    CHECK(hanging[0]["time"].get<double>() > 0.59);
    CHECK(hanging[0]["time"].get<double>() < 0.6 + 2.0 * 0.05 / 0.5);
    CHECK(hanging[0]["material"].get<std::string>().starts_with("Mask"));
    CHECK(hanging[0]["volume"].get<double>() == Approx(0.6 * 0.2 * 0.2).epsilon(0.1));
    CHECK(hanging[0]["step"] == 1);
    // Half of the line at a reflective side, which mirrors it.
    const json half = run_events(kUndercut + "1.2\n", {"layer[1].position=[1.0,0.0]"});
    REQUIRE(events(half, "piece-detached").size() == 1);
    CHECK(events(half, "piece-detached")[0]["volume"].get<double>() ==
          Approx(0.5 * 0.6 * 0.2 * 0.2).epsilon(0.1));
    // The mask is no detached piece as long as silicon holds it.
    CHECK(run_events(kUndercut + "0.5\n")["events"].empty());

    const json closed = run_events(R"([domain]
extent = [2.0, 0.2]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
[simplify]
method = "none"
[[layer]]
material = "Si"
shape = "trench"
width = 0.6
depth = 1.0
taper_deg = -10.0
[[step]]
model = "isotropic"
rate = 0.5
deposit = "SiO2"
duration = 0.8
)");
    const auto voids = events(closed, "void-closed");
    REQUIRE(closed["events"].size() == 1);
    REQUIRE(voids.size() == 1);
    // The opening closes when the film on both sides is half its width.
    CHECK(voids[0]["time"].get<double>() == Approx(0.6).margin(2.0 * 0.05 / 0.5));
    CHECK(voids[0]["count"] == 1);
}

TEST_CASE("who stops a run while its wafer is built waits for no layer, and finds nothing written") {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(kUndercut + "1.2\n", "events.toml");
    int asked = 0;
    const std::function<bool()> stop = [&] { return ++asked == 3; };
    CHECK_THROWS_WITH(
        app::run_recipe(recipe, {.output = folder.path / "out", .quiet = true, .stop = stop}),
        Catch::Matchers::Contains("stopped while the wafer was built: nothing has been written"));
    CHECK(asked >= 3);
    CHECK_FALSE(std::filesystem::exists(folder.path / "out" / "manifest.txt"));
}

TEST_CASE("a material that vanishes is told with its time and step, whatever corners hold of it") {
    // The nitride is etched through after 1.2 s; the oxide below stays.
    const std::string wafer = kEventStrip + R"([[layer]]
material = "SiO2"
thickness = 0.1
[[layer]]
material = "Si3N4"
shape = "trench"
width = 0.8
thickness = 0.18
)";
    const json mask = run_events(wafer + R"([[step]]
name = "etch"
model = "isotropic"
duration = 2.0
rate = { Si3N4 = -0.15 }
)");
    REQUIRE(mask["vanished"].size() == 1);
    CHECK(mask["vanished"][0]["material"] == "Si3N4");
    CHECK(mask["vanished"][0]["time"].get<double>() == Approx(1.2).margin(0.5 * 0.05 / 0.15));
    CHECK(mask["vanished"][0]["step"] == 1);
    REQUIRE(events(mask, "material-vanished").size() == 1);
    CHECK(events(mask, "material-vanished")[0]["name"] == "1 etch");

    // A film is deposited and removed twice; residues in the trench's corners do not count as film.
    const json film = run_events(wafer + R"([[step]]
repeat = 2
[[step.steps]]
name = "coat"
model = "conformal"
material = "Polymer"
thickness = 0.12
[[step.steps]]
name = "clean"
model = "isotropic"
duration = 1.0
rate = { Polymer = -0.3 }
)");
    REQUIRE(film["vanished"].size() == 2);
    for (std::size_t k = 0; k < 2; ++k) {
        CHECK(film["vanished"][k]["material"] == "Polymer");
        CHECK(film["vanished"][k]["step"] == 2 * (k + 1));
        // 0.4 s for the film, root 2 times that for the corners.
        const double time = film["vanished"][k]["time"].get<double>() - static_cast<double>(k),
                     step = 0.5 * 0.05 / 0.3;
        CHECK(time > 0.4 - step);
        CHECK(time < 0.4 * std::sqrt(2.0) + 2.0 * step);
    }
    // A step that takes no time makes a material vanish, too.
    const json strip =
        run_events(wafer + "[[step]]\nmodel = \"strip\"\nmaterial = \"Si3N4\"\n" +
                   "[[step]]\nmodel = \"isotropic\"\nrate = 0.1\ndeposit = \"W\"\nduration = 0.5\n");
    REQUIRE(strip["vanished"].size() == 1);
    CHECK(strip["vanished"][0]["step"] == 1);
    CHECK(strip["vanished"][0]["time"] == 0.0);
}

TEST_CASE("a surface that reaches the bottom of the substrate or the top of the films' room is told") {
    const std::string blanket = R"([domain]
extent = [0.4, 0.4]
grid_spacing = 0.1
boundary = ["periodic", "periodic"]
[[layer]]
material = "Si"
)";
    // A recipe describes a wafer up to 20,000 grid spacings from z = 0.
    const json down =
        run_events(blanket + "top = -1999.9\n[[step]]\nmodel = \"isotropic\"\nrate = -0.1\nduration = 2.0\n");
    REQUIRE(down["events"].size() == 1);
    CHECK(down["events"][0]["kind"] == "bottom-reached");
    CHECK(down["events"][0]["time"].get<double>() == Approx(1.0).margin(0.51));
    const json up = run_events(blanket + "top = 1999.9\n[[step]]\nmodel = \"isotropic\"\nrate = 0.1\n" +
                               "deposit = \"SiO2\"\nduration = 2.0\n");
    REQUIRE(up["events"].size() == 1);
    CHECK(up["events"][0]["kind"] == "top-reached");

    // A wafer with an underside at z = -0.6, and 0.2 left below its trench.
    const test::Folder folder;
    const double profile[][2] = {{-4.0, 0.0}, {-0.3, 0.0}, {-0.3, -0.4}, {0.3, -0.4},
                                 {0.3, 0.0},  {4.0, 0.0},  {4.0, -0.6},  {-4.0, -0.6}};
    std::ofstream mesh(folder.path / "wafer.obj");
    for (const auto& [x, z] : profile)
        for (const double y : {-4.0, 4.0}) mesh << "v " << x << " " << y << " " << z << "\n";
    for (int k = 0; k < 8; ++k) {
        const int a = 2 * k + 1, b = 2 * ((k + 1) % 8) + 1;
        mesh << "f " << a << " " << b << " " << b + 1 << "\nf " << a << " " << b + 1 << " " << a + 1 << "\n";
    }
    mesh.close();
    std::ofstream(folder.path / "wafer.toml") << R"([domain]
extent = [2.0, 0.2]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
[simplify]
method = "none"
[[layer]]
material = "Si"
shape = "mesh"
file = "wafer.obj"
[[step]]
model = "isotropic"
rate = -0.1
duration = 3.0
)";
    const json through = app::run_recipe(app::load_recipe(folder.path / "wafer.toml"),
                                         {.output = folder.path / "out", .quiet = true})
                             .summary;
    REQUIRE(events(through, "bottom-reached").size() == 1);
    const json event = events(through, "bottom-reached")[0];
    CHECK(event["time"].get<double>() == Approx(2.0).margin(2.0 * 0.05 / 0.1));
    CHECK(event["at"][2].get<double>() == Approx(-0.6).margin(0.01));
}

TEST_CASE("the summary tells how long every step took, why it ended, and what it moved") {
    const json summary = run_events(kEventStrip + R"([[layer]]
material = "SiO2"
thickness = 0.3
[[step]]
model = "conformal"
material = "Polymer"
thickness = 0.1
[[step]]
name = "etch"
model = "isotropic"
duration = 9.0
rate = { Polymer = -0.1, SiO2 = -0.1 }
stop_material = "SiO2"
[[step]]
name = "deeper"
model = "isotropic"
duration = 9.0
rate = -0.1
stop_depth = -0.1
[[step]]
name = "again"
model = "isotropic"
duration = 0.7
rate = 0.1
deposit = "Polymer"
[metrology]
measures = ["depth", "film"]
)");
    const json& steps = summary["steps"];
    REQUIRE(steps.size() == 4);
    const char* why[] = {"duration", "stop_material", "stop_depth", "duration"};
    const double asked[] = {0.0, 9.0, 9.0, 0.7}, took[] = {0.0, 1.0, 2.0, 0.7};
    double time = 0.0;  // a stop is overshot by a twentieth of a cell at most, 0.025 s here
    for (std::size_t k = 0; k < 4; ++k) {
        CHECK(steps[k]["stopped_by"] == why[k]);
        CHECK(steps[k]["asked_duration"] == asked[k]);
        CHECK(steps[k]["duration"].get<double>() == Approx(took[k]).margin(0.026));
        time += steps[k]["duration"].get<double>();
    }
    CHECK(summary["time"].get<double>() == Approx(time));
    // Volumes on a wafer of 2.0 x 0.2.
    const json& volumes = summary["volumes"];
    CHECK(volumes["Polymer"]["gross_added"].get<double>() == Approx(0.4 * (0.1 + 0.07)).epsilon(0.01));
    CHECK(volumes["Polymer"]["gross_removed"].get<double>() == Approx(0.4 * 0.1).epsilon(0.01));
    CHECK(volumes["Polymer"]["net"].get<double>() == Approx(0.4 * 0.07).epsilon(0.01));
    CHECK(volumes["SiO2"]["net"].get<double>() == Approx(-0.4 * 0.2).epsilon(0.01));
    CHECK(volumes["Si"]["net"] == 0.0);
    CHECK(summary["volume_unit"] == "um^3");
    // A flat wafer has no step to cover.
    CHECK(summary["metrology"]["film_top"].get<double>() == Approx(0.07).epsilon(0.01));
    CHECK_FALSE(summary["metrology"].contains("step_coverage_bottom"));
    CHECK_FALSE(summary["metrology"].contains("step_coverage_side"));
    // No figure has more than nine digits.
    const auto check = [](const json& part, auto&& self) -> void {
        if (part.is_structured())
            for (const json& inner : part) self(inner, self);
        else if (part.is_number_float()) {
            // Its text may be longer: the JSON writer takes 17 digits for some numbers that need three.
            const double value = part;
            CHECK(std::stod(fmt::format("{:.9g}", value)) == value);
        }
    };
    check(summary, check);
}

TEST_CASE("step coverage is that of a film in a trench that it does not fill") {
    const auto coverage = [](const std::string& duration) {
        return run_events(R"([domain]
extent = [2.0, 0.2]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
shape = "trench"
width = 0.6
depth = 0.6
[[step]]
model = "isotropic"
rate = 0.1
deposit = "SiO2"
duration = )" + duration + "\n[metrology]\nmeasures = [\"film\"]\n")["metrology"];
    };
    CHECK(coverage("1.0")["step_coverage_side"].get<double>() == Approx(1.0).epsilon(0.02));
    CHECK(coverage("1.0")["step_coverage_bottom"].get<double>() == Approx(1.0).epsilon(0.02));
    CHECK_FALSE(coverage("0.005").contains("step_coverage_bottom"));  // a hundredth of a cell
    CHECK_FALSE(coverage("5.0").contains("step_coverage_bottom"));    // the trench is full
}

TEST_CASE("a run that no terminal shows tells its tenths and events on standard error, a quiet one nothing") {
    const test::Folder folder;
    std::ofstream(folder.path / "mask.toml") << kUndercut << "1.0\n";
    const auto told = test::run_program(folder.path, "run mask.toml -o out");
    REQUIRE(told.exit_code == 0);
    INFO(told.output);
    for (int tenth = 1; tenth <= 10; ++tenth)
        CHECK(test::count(told.output, "mask: " + std::to_string(10 * tenth) + " %, ") == 1);
    CHECK(test::count(told.output, " ETA ") == 10);
    CHECK(test::count(told.output, "a piece of Mask") == 1);
    CHECK(test::count(told.output, "phase") == 1);  // the report
    // Standard output is JSON alone; the comment keeps the other stream out of it.
    const auto piped = test::run_program(folder.path, "run mask.toml -o out --json - 2>log #");
    REQUIRE(piped.exit_code == 0);
    const json summary = json::parse(piped.output);
    CHECK(summary == json::parse(test::read_bytes(folder.path / "out" / "summary.json")));
    CHECK(test::count(test::read_bytes(folder.path / "log"), "\n") == 11);

    const auto quiet = test::run_program(folder.path, "run mask.toml -o out --quiet --json copy.json");
    CHECK(quiet.exit_code == 0);
    CHECK(quiet.output.empty());
    CHECK(json::parse(test::read_bytes(folder.path / "copy.json"))["events"] == summary["events"]);
}

TEST_CASE("a run stopped after an event and resumed tells the same summary as one that was not", "[slow]") {
    const test::Folder folder;
    std::ofstream(folder.path / "mask.toml") << kUndercut << "2.4\n[output]\nevery = 0.4\n";
    REQUIRE(test::run_program(folder.path, "run mask.toml -o whole --quiet").exit_code == 0);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        const std::string start = "cd '" + folder.path.string() +
                                  "' && exec '" SIDEWALL_PROGRAM
                                  "' run mask.toml -o parts >log 2>&1 </dev/null";
        execl("/bin/sh", "sh", "-c", start.c_str(), static_cast<char*>(nullptr));
        _exit(127);
    }
    const auto log = [&] { return test::read_bytes(folder.path / "log"); };
    for (int tick = 0; tick < 6000 && test::count(log(), "hangs in the gas") == 0; ++tick)
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    kill(child, SIGINT);
    int status = 0;
    waitpid(child, &status, 0);
    INFO(log());
    REQUIRE(WIFEXITED(status));
    REQUIRE(WEXITSTATUS(status) == 130);
    const auto resumed = test::run_program(folder.path, "run mask.toml -o parts --resume");
    INFO(resumed.output);
    REQUIRE(resumed.exit_code == 0);
    CHECK(test::count(resumed.output, "hangs in the gas") == 0);  // it was reported before
    const auto summary = [&](const char* name) {
        json read = json::parse(test::read_bytes(folder.path / name / "summary.json"));
        read.erase("timing");
        return read;
    };
    CHECK(summary("parts") == summary("whole"));
    CHECK(summary("parts")["events"].size() == 1);
}
